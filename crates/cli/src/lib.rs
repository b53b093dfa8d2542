//! What a person types: one subcommand, one module.
//!
//! Exit codes: 0 done; 1 it did not work out; 2 usage; 3 an input or configuration that cannot be
//! used; 4 the network.

mod calibrate;
mod check;
mod command_line;
mod csv_rows;
mod demo;
mod detect;
mod failure;
mod model;
mod paint;
mod progress;
mod shipped;
mod study;
mod table;

use std::process::ExitCode;

use clap::Parser;

use command_line::{Command, CommandLine};

/// Reads the command line and does what it says.
#[must_use]
pub fn run() -> ExitCode {
    let done = match CommandLine::parse().command {
        Command::Model(arguments) => model::run(&arguments),
        Command::Detect(arguments) => detect::run(&arguments),
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Calibrate(arguments) => calibrate::run(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Study(arguments) => study::run(&arguments),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
