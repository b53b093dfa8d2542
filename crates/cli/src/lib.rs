//! What a person types: one subcommand, one module.
//!
//! Exit codes: 0 done; 1 it did not work out; 2 usage; 3 an input or configuration that cannot be
//! used; 4 the network.

mod calibrate;
mod certificates;
mod check;
mod command_line;
mod csv_rows;
mod demo;
mod detect;
mod failure;
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
mod paint;
mod program;
mod progress;
mod repeat;
mod router;
mod schema;
mod shipped;
mod study;
mod table;
mod telling;

use std::process::ExitCode;

use clap::Parser;

use command_line::{Command, CommandLine};

/// Reads the command line and does what it says. Called by the name of another program of ours, it is that
/// program.
#[must_use]
pub fn run() -> ExitCode {
    if let Some(main) = program::by_name() {
        return main();
    }
    let done = match CommandLine::parse().command {
        Command::Model(arguments) => model::run(&arguments),
        Command::Detect(arguments) => detect::run(&arguments),
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Calibrate(arguments) => calibrate::run(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Faults(arguments) => faults::run(&arguments),
        Command::Follow(arguments) => follow::run(&arguments),
        Command::Ack(arguments) => order::acknowledge(&arguments),
        Command::Reset(arguments) => order::reset(&arguments),
        Command::Health(arguments) => health::run(&arguments),
        Command::Generate(arguments) => generate::run(&arguments),
        Command::History(arguments) => history::run(&arguments),
        Command::Inject(arguments) => inject::run(&arguments),
        Command::Study(arguments) => study::run(&arguments),
        Command::Repeat(arguments) => repeat::run(&arguments),
        Command::Pki(arguments) => certificates::run(&arguments),
        Command::Schema(arguments) => schema::run(&arguments),
        Command::Join(arguments) => join::run(&arguments),
        Command::Router(arguments) => return router::run(arguments),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
