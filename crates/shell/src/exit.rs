//! Exit codes and errors of a process.

use std::io::Write;
use std::process::ExitCode;

use session::NetworkError;
use settings::ConfigErrors;
use vocabulary::printable_lines;

use crate::health::HealthAddressError;

/// The description of exit codes in `--help`.
pub const EXIT_CODES: &str = "\
Exit codes:
  0  done, or stopped by SIGTERM or SIGINT
  1  failed while running
  2  wrong use of the command line, e.g. an invalid endpoint in a flag
  3  the configuration is not valid
  4  the network cannot be used as configured (busy port, address that is not here)";

/// Why a process failed.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// Exit code 1.
    #[error("{0}")]
    Running(String),
    /// Exit code 3.
    #[error(transparent)]
    Config(#[from] ConfigErrors),
    /// Exit code 4, or 3 if the file of Zenoh's settings is invalid.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// Exit code 4.
    #[error(transparent)]
    Health(#[from] HealthAddressError),
}

impl Failure {
    /// The process's exit code.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Failure::Running(_) => 1,
            Failure::Config(_) | Failure::Network(NetworkError::File { .. }) => 3,
            Failure::Network(_) | Failure::Health(_) => 4,
        }
    }

    /// An operation that failed at run time, with the cause.
    pub fn running(what: &str, error: impl std::fmt::Display) -> Self {
        Failure::Running(format!("{what}: {error}"))
    }
}

/// Reports the error, whatever the log filter, and returns the exit code.
#[must_use]
pub fn conclude(result: Result<(), Failure>) -> ExitCode {
    let Err(failure) = result else { return ExitCode::SUCCESS };
    // If standard error is closed, the exit code is the only report.
    let text = printable_lines(&failure.to_string());
    let _ = writeln!(std::io::stderr(), "error: {text}");
    ExitCode::from(failure.exit_code())
}
