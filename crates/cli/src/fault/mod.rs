//! `trusswatch fault`: one component's fault.

mod finding;
mod frame;
mod report;
mod show;

use clap::Subcommand;

use crate::failure::Failure;

/// Look at the fault of one component
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Show(show::Arguments),
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    match &arguments.command {
        Command::Show(arguments) => show::run(arguments),
    }
}
