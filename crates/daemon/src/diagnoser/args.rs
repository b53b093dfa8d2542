//! The command line of `trusswatch-diagnoser`.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::config::{ConfigErrors, NetworkFlags, load_diagnoser};
use crate::exit::{EXIT_CODES, Failure, conclude};
use crate::{logging, runtime};

/// Fault diagnosis of one module: isolates actuator faults alone, sensor faults with its peers.
///
/// Logs go to standard error; TRUSSWATCH_LOG filters them, e.g. `TRUSSWATCH_LOG=debug`.
#[derive(Debug, Parser)]
#[command(name = "trusswatch-diagnoser", version, after_help = EXIT_CODES)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Diagnose until SIGTERM or SIGINT
    #[command(after_help = EXIT_CODES)]
    Run {
        /// The module's configuration
        config: PathBuf,
        #[command(flatten)]
        network: NetworkFlags,
    },
    /// Check configurations and everything they name, without starting
    #[command(after_help = EXIT_CODES)]
    Check {
        /// The modules' configurations
        #[arg(required = true)]
        configs: Vec<PathBuf>,
    },
}

/// The whole program.
#[must_use]
pub fn main() -> ExitCode {
    conclude(match Arguments::parse().command {
        Command::Run { config, network } => run(&config, &network),
        Command::Check { configs } => check(&configs),
    })
}

fn run(config: &std::path::Path, network: &NetworkFlags) -> Result<(), Failure> {
    logging::start();
    let config = load_diagnoser(config)?.with_flags(network)?;
    runtime::until_done(|shutdown| super::run(config, shutdown))
}

fn check(configs: &[PathBuf]) -> Result<(), Failure> {
    let mut errors = ConfigErrors(Vec::new());
    for file in configs {
        if let Some(config) = errors.collect(load_diagnoser(file)) {
            let (actuators, gages) = config.size();
            let summary = format!(
                "{}: valid: module `{}` of `{}`, {actuators} actuators, {gages} gages, peers: {}, thresholds {}",
                file.display(),
                config.module(),
                config.structure_name,
                config.peers().len(),
                config.thresholds,
            );
            writeln!(std::io::stdout(), "{summary}")
                .map_err(|error| Failure::running("standard output", error))?;
        }
    }
    Ok(errors.or(())?)
}
