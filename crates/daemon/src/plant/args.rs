//! The command line of `trusswatch-plant`.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};
use settings::ConfigErrors;
use shell::exit::{EXIT_CODES, Failure, conclude};
use shell::shutdown::ShutdownFlags;
use shell::{logging, runtime};

use crate::config::{PlantFlags, load_plant};

/// The simulated tower: wind, hydraulics, gages and controller, with faults on demand.
///
/// Logs go to standard error, or to the journal of systemd if that is where standard error leads;
/// TRUSSWATCH_LOG filters them, e.g. `TRUSSWATCH_LOG=debug`.
#[derive(Debug, Parser)]
#[command(name = "trusswatch-plant", version, after_help = EXIT_CODES)]
struct Arguments {
    #[command(subcommand)]
    command: PlantSubcommand,
}

#[derive(Debug, Subcommand)]
enum PlantSubcommand {
    /// Simulate until the last step, SIGTERM or SIGINT
    #[command(after_help = EXIT_CODES)]
    Run {
        /// The plant's configuration
        config: PathBuf,
        #[command(flatten)]
        flags: PlantFlags,
        #[command(flatten)]
        shutdown: ShutdownFlags,
    },
    /// Check configurations and everything they name, without starting
    #[command(after_help = EXIT_CODES)]
    Check {
        /// The plants' configurations
        #[arg(required = true)]
        configs: Vec<PathBuf>,
    },
}

/// The command line as data, for manual pages and completions.
#[must_use]
pub fn command_line() -> clap::Command {
    Arguments::command()
}

/// The whole program.
#[must_use]
pub fn main() -> ExitCode {
    conclude(match Arguments::parse().command {
        PlantSubcommand::Run { config, flags, shutdown } => run(&config, &flags, shutdown),
        PlantSubcommand::Check { configs } => check(&configs),
    })
}

fn run(
    config: &std::path::Path,
    flags: &PlantFlags,
    shutdown: ShutdownFlags,
) -> Result<(), Failure> {
    logging::start();
    let config = load_plant(config, flags)?;
    runtime::until_done(shutdown, |shutdown| super::run(config, shutdown))
}

fn check(configs: &[PathBuf]) -> Result<(), Failure> {
    let mut errors = ConfigErrors(Vec::new());
    for file in configs {
        if let Some(config) = errors.collect(load_plant(file, &PlantFlags::default())) {
            let modules: Vec<String> =
                config.structure.equipped().map(|module| module.name.to_string()).collect();
            let summary = format!(
                "{}: valid: structure `{}`, modules {}, seed {}, speed {}",
                file.display(),
                config.structure.name,
                modules.join(", "),
                config.seed,
                config.speed,
            );
            writeln!(std::io::stdout(), "{summary}")
                .map_err(|error| Failure::running("standard output", error))?;
        }
    }
    Ok(errors.or(())?)
}
