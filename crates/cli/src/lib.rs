//! The command line: one module per subcommand.
//!
//! Exit codes: 0 done; 1 operation failed; 2 usage; 3 invalid input or configuration; 4 network failure; 130
//! interrupted before it was done.

mod calibrate;
mod certificates;
mod check;
mod command_line;
mod commission;
mod context;
mod demo;
mod detect;
#[cfg(test)]
mod documents_test;
mod export;
mod failure;
mod fault;
mod faults;
mod follow;
mod generate;
mod health;
mod history;
mod import;
mod inject;
mod join;
mod learn;
mod link;
mod model;
mod new;
mod notify;
mod order;
mod output;
mod paint;
mod plant_order;
mod progress;
mod record;
mod replay;
mod replicate;
mod router;
mod schema;
mod shipped;
mod simulate;
mod stroke;
mod study;
mod table;
mod watch;
mod web;

use std::ffi::OsStr;
use std::path::Path;
use std::process::ExitCode;

use clap::FromArgMatches;

use command_line::{CommandLine, TopCommand};

/// Parses the command line and runs the subcommand. Under the name of another of the three programs, it runs as that
/// program.
#[must_use]
pub fn run() -> ExitCode {
    if let Some(main) = other_program() {
        return main();
    }
    let parsed = CommandLine::from_arg_matches(&command_line::command().get_matches());
    // The matches come from the command that these types define.
    let done = match parsed.unwrap_or_else(|error| error.exit()).command {
        TopCommand::Model(arguments) => model::run(&arguments),
        TopCommand::New(arguments) => new::run(&arguments),
        TopCommand::Detect(arguments) => detect::run(&arguments),
        TopCommand::Import(arguments) => import::run(&arguments),
        TopCommand::Learn(arguments) => learn::run(&arguments),
        TopCommand::Replay(arguments) => replay::run(&arguments),
        TopCommand::Export(arguments) => export::run(&arguments),
        TopCommand::Demo(arguments) => demo::run(&arguments),
        TopCommand::Calibrate(arguments) => calibrate::run(&arguments),
        TopCommand::Commission(arguments) => commission::run(&arguments),
        TopCommand::Check(arguments) => check::run(&arguments),
        TopCommand::Faults(arguments) => faults::run(&arguments),
        TopCommand::Follow(arguments) => follow::run(&arguments),
        TopCommand::Ack(arguments) => order::acknowledge(&arguments),
        TopCommand::Reset(arguments) => order::reset(&arguments),
        TopCommand::Health(arguments) => health::run(&arguments),
        TopCommand::Completions(arguments) => {
            generate::completions(&arguments, command_line::command())
        }
        TopCommand::Generate(arguments) => generate::run(&arguments, programs()),
        TopCommand::Fault(arguments) => fault::run(&arguments),
        TopCommand::Watch(arguments) => watch::run(&arguments),
        TopCommand::History(arguments) => history::run(&arguments),
        TopCommand::Inject(arguments) => inject::run(&arguments),
        TopCommand::Stroke(arguments) => stroke::run(&arguments),
        TopCommand::Simulate(arguments) => simulate::run(&arguments),
        TopCommand::Study(arguments) => study::run(&arguments),
        TopCommand::Replicate(arguments) => replicate::run(&arguments),
        TopCommand::Pki(arguments) => certificates::run(&arguments),
        TopCommand::Schema(arguments) => schema::run(&arguments),
        TopCommand::Join(arguments) => join::run(&arguments),
        TopCommand::Record(arguments) => record::run(&arguments),
        TopCommand::Web(arguments) => web::run(&arguments),
        TopCommand::Notify(arguments) => notify::run(&arguments),
        TopCommand::Router(arguments) => return router::run(arguments),
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

/// The main function of a program.
type Main = fn() -> ExitCode;

/// The other programs by name: in images where size matters, one file contains all of them.
const OTHERS: [(&str, Main); 2] =
    [("trusswatch-diagnoser", daemon::diagnoser::main), ("trusswatch-plant", daemon::plant::main)];

/// The program whose name was used to start this file; `None` for `trusswatch` and unknown names.
fn other_program() -> Option<Main> {
    named(&std::env::args_os().next()?)
}

fn named(called: &OsStr) -> Option<Main> {
    let name = Path::new(called).file_name()?;
    OTHERS.iter().find(|(known, _)| name == *known).map(|(_, main)| *main)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_name_counts_not_the_way_there() {
        let is_other = |called: &str| named(OsStr::new(called)).is_some();
        assert!(is_other("trusswatch-diagnoser") && is_other("/bin/trusswatch-plant"));
        assert!(!is_other("/bin/trusswatch") && !is_other("trusswatch-diagnoser/other"));
        assert!(!is_other(""));
    }
}
