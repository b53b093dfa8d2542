//! `trusswatch router`: a router that enforces who may say what.

use std::path::PathBuf;
use std::process::ExitCode;

use daemon::config::NetworkFlags;

/// Pass on what modules, operators and observers say, and enforce who may say what
///
/// A Zenoh router with settings like those of `trusswatch pki access`, until SIGTERM or SIGINT. What it
/// refuses it tells on standard error.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Zenoh's own settings (JSON5), with the mode `router`
    #[arg(long, value_name = "FILE")]
    zenoh: PathBuf,
    #[command(flatten)]
    network: NetworkFlags,
}

pub(crate) fn run(arguments: Arguments) -> ExitCode {
    daemon::router::main(arguments.zenoh, arguments.network)
}
