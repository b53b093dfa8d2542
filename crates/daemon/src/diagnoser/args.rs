//! The command line of `trusswatch-diagnoser`.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};
use session::NetworkFlags;
use settings::ConfigErrors;
use shell::exit::{EXIT_CODES, Failure, conclude};
use shell::health::HealthFlags;
use shell::shutdown::ShutdownFlags;
use shell::{logging, runtime};

use crate::config::load_diagnoser;

/// Fault diagnosis of one module: isolates actuator faults alone, sensor faults with its peers.
///
/// Logs go to standard error, or to the journal of systemd if that is where standard error leads;
/// TRUSSWATCH_LOG filters them, e.g. `TRUSSWATCH_LOG=debug`.
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
    Run(Run),
    /// Check configurations and everything they name, without starting
    #[command(after_help = EXIT_CODES)]
    Check {
        /// The modules' configurations
        #[arg(required = true)]
        configs: Vec<PathBuf>,
    },
}

#[derive(Debug, clap::Args)]
struct Run {
    /// The module's configuration
    config: PathBuf,
    /// Keep the journal of faults in this directory, whatever the configuration says
    #[arg(long, value_name = "DIRECTORY")]
    state_dir: Option<PathBuf>,
    /// Use no reference, whatever the configuration says: components are normal, not verified
    #[arg(long)]
    no_reference: bool,
    #[command(flatten)]
    network: NetworkFlags,
    #[command(flatten)]
    health: HealthFlags,
    #[command(flatten)]
    shutdown: ShutdownFlags,
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
        Command::Run(arguments) => run(arguments),
        Command::Check { configs } => check(&configs),
    })
}

fn run(arguments: Run) -> Result<(), Failure> {
    let Run { config, state_dir, no_reference, network, health, shutdown } = arguments;
    logging::start();
    let config = load_diagnoser(&config)?.with_flags(&network)?.with_health(&health)?;
    let config = config.with_state_directory(state_dir).with_reference(!no_reference);
    runtime::until_done(shutdown, |shutdown| super::run(config, shutdown))
}

fn check(configs: &[PathBuf]) -> Result<(), Failure> {
    let mut errors = ConfigErrors(Vec::new());
    for file in configs {
        if let Some(config) = errors.collect(load_diagnoser(file)) {
            let (actuators, gages) = config.size();
            let summary = format!(
                "{}: valid: module `{}` of `{}`, {actuators} actuators, {gages} gages, peers: {}, thresholds {}, {}",
                file.display(),
                config.module(),
                config.structure_name,
                config.peers().len(),
                config.thresholds,
                config.reference().map_or_else(
                    || "no reference".to_owned(),
                    |fingerprint| format!("reference {fingerprint}"),
                ),
            );
            writeln!(std::io::stdout(), "{summary}")
                .map_err(|error| Failure::running("standard output", error))?;
        }
    }
    Ok(errors.or(())?)
}
