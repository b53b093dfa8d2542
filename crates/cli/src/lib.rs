//! The command line: one subcommand, one module.
//!
//! Exit codes: 0 done; 1 operation failed; 2 usage; 3 an input or configuration that cannot be
//! used; 4 the network; 130 interrupted before it was done.

mod calibrate;
mod certificates;
mod check;
mod command_line;
mod commission;
mod completions;
mod context;
mod csv_rows;
mod demo;
mod detect;
#[cfg(test)]
mod documents;
mod export;
mod failure;
mod fault;
mod faults;
mod follow;
mod generate;
mod health;
mod history;
mod inject;
mod join;
mod link;
mod model;
mod order;
mod output;
mod paint;
mod plant_order;
mod program;
mod progress;
mod record;
mod replay;
mod replicate;
mod router;
mod schema;
mod shipped;
mod stroke;
mod study;
mod table;
mod watch;
mod web;
mod web_access;

use std::process::ExitCode;

use clap::FromArgMatches;

use command_line::{Command, CommandLine};

/// Parses the command line and runs the subcommand. Called by the name of another program of ours, it is
/// that program.
#[must_use]
pub fn run() -> ExitCode {
    if let Some(main) = program::by_name() {
        return main();
    }
    let parsed = CommandLine::from_arg_matches(&command_line::command().get_matches());
    // What clap matched is what the types were derived from.
    let done = match parsed.unwrap_or_else(|error| error.exit()).command {
        Command::Model(arguments) => model::run(&arguments),
        Command::Detect(arguments) => detect::run(&arguments),
        Command::Replay(arguments) => replay::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Calibrate(arguments) => calibrate::run(&arguments),
        Command::Commission(arguments) => commission::run(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Faults(arguments) => faults::run(&arguments),
        Command::Follow(arguments) => follow::run(&arguments),
        Command::Ack(arguments) => order::acknowledge(&arguments),
        Command::Reset(arguments) => order::reset(&arguments),
        Command::Health(arguments) => health::run(&arguments),
        Command::Completions(arguments) => completions::run(&arguments, command_line::command()),
        Command::Generate(arguments) => generate::run(&arguments, programs()),
        Command::Fault(arguments) => fault::run(&arguments),
        Command::Watch(arguments) => watch::run(&arguments),
        Command::History(arguments) => history::run(&arguments),
        Command::Inject(arguments) => inject::run(&arguments),
        Command::Stroke(arguments) => stroke::run(&arguments),
        Command::Study(arguments) => study::run(&arguments),
        Command::Replicate(arguments) => replicate::run(&arguments),
        Command::Pki(arguments) => certificates::run(&arguments),
        Command::Schema(arguments) => schema::run(&arguments),
        Command::Join(arguments) => join::run(&arguments),
        Command::Record(arguments) => record::run(&arguments),
        Command::Web(arguments) => web::run(&arguments),
        Command::Router(arguments) => return router::run(arguments),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}

/// The command lines of all three programs.
fn programs() -> [clap::Command; 3] {
    [command_line::command(), daemon::diagnoser::command_line(), daemon::plant::command_line()]
}
