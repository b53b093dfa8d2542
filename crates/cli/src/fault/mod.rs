//! `trusswatch fault`: one component's fault, and its alarm.

mod finding;
mod frame;
mod report;
mod show;

use clap::Subcommand;

use crate::failure::Failure;
use crate::order;

/// Look at the fault of one component; shelve alarms, or suppress those of a module
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Show(show::Arguments),
    Shelve(order::ShelveArguments),
    Unshelve(order::UnshelveArguments),
    Suppress(order::SuppressArguments),
    Unsuppress(order::UnsuppressArguments),
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    match &arguments.command {
        Command::Show(arguments) => show::run(arguments),
        Command::Shelve(arguments) => order::shelve(arguments),
        Command::Unshelve(arguments) => order::unshelve(arguments),
        Command::Suppress(arguments) => order::suppress(arguments),
        Command::Unsuppress(arguments) => order::unsuppress(arguments),
    }
}
