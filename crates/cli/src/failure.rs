//! Failures of commands: an exit code, and messages on standard error.

use std::fmt::Display;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;

use session::client::AttendanceError;
use settings::ConfigErrors;
use vocabulary::printable_lines;

/// The exit codes, for `--help`.
pub(crate) const EXIT_CODES: &str = "\
Exit codes:
    0  done
    1  operation failed; demo: injected and diagnosed faults differ; replay --verify: a difference;
       ack, reset, inject and stroke: refused; faults --exit-code and health: not healthy
    2  wrong use of the command line
    3  a file that cannot be used
    4  network failure or no answer
    5  ack, reset: done, but not saved on the module's disk
    6  replay --verify: no difference, but not everything recorded could be compared; replay with
       other settings: what would have been named is not known of every component
  130  interrupted before it was done";

/// Why a command failed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Failure {
    exit_code: u8,
    messages: Vec<String>,
}

impl Failure {
    fn new(exit_code: u8, message: impl Into<String>) -> Failure {
        Failure { exit_code, messages: vec![message.into()] }
    }

    /// The operation failed.
    pub(crate) fn runtime(message: impl Into<String>) -> Failure {
        Failure::new(1, message)
    }

    /// The operation failed, and the reason was printed already.
    pub(crate) fn reported() -> Failure {
        Failure { exit_code: 1, messages: Vec::new() }
    }

    /// A signal ended the command before it was done.
    pub(crate) fn interrupted(message: impl Into<String>) -> Failure {
        Failure::new(130, message)
    }

    /// Invalid arguments.
    pub(crate) fn usage(message: impl Into<String>) -> Failure {
        Failure::new(2, message)
    }

    /// A file is not usable.
    pub(crate) fn input(message: impl Into<String>) -> Failure {
        Failure::new(3, message)
    }

    /// Files are not usable, for these reasons.
    pub(crate) fn inputs(messages: Vec<String>) -> Failure {
        Failure { exit_code: 3, messages }
    }

    /// A file or directory cannot be read.
    pub(crate) fn unreadable(path: &Path, error: impl Display) -> Failure {
        let meant = settings::did_you_mean(path);
        Failure::input(format!("cannot read `{}`: {error}{meant}", path.display()))
    }

    /// A file or directory cannot be written.
    pub(crate) fn unwritable(path: &Path, error: impl Display) -> Failure {
        Failure::runtime(format!("cannot write `{}`: {error}", path.display()))
    }

    /// A network failure.
    pub(crate) fn network(message: impl Into<String>) -> Failure {
        Failure::new(4, message)
    }

    /// The operation failed, for these reasons.
    pub(crate) fn runtimes(messages: Vec<String>) -> Failure {
        Failure { exit_code: 1, messages }
    }

    /// Done but not saved, for these reasons.
    pub(crate) fn not_saved(messages: Vec<String>) -> Failure {
        Failure { exit_code: 5, messages }
    }

    /// No difference was found, but not everything was compared, for each of these reasons.
    pub(crate) fn not_compared(messages: Vec<String>) -> Failure {
        Failure { exit_code: 6, messages }
    }

    /// The network, for each of these reasons.
    pub(crate) fn networks(messages: Vec<String>) -> Failure {
        Failure { exit_code: 4, messages }
    }

    /// The messages on one line.
    pub(crate) fn in_words(&self) -> String {
        self.messages.join("; ")
    }

    /// Prints the messages on standard error.
    pub(crate) fn report(&self) -> ExitCode {
        let mut stderr = io::stderr().lock();
        for message in &self.messages {
            // Standard error may be closed too.
            let _ = writeln!(stderr, "error: {}", printable_lines(message));
        }
        ExitCode::from(self.exit_code)
    }
}

/// Errors in configurations.
impl From<tables::TableError> for Failure {
    fn from(error: tables::TableError) -> Failure {
        Failure::input(error.to_string())
    }
}

impl From<ConfigErrors> for Failure {
    fn from(errors: ConfigErrors) -> Failure {
        Failure::inputs(errors.0.iter().map(ToString::to_string).collect())
    }
}

/// Presence cannot be observed on the network.
impl From<AttendanceError> for Failure {
    fn from(error: AttendanceError) -> Failure {
        Failure::network(error.to_string())
    }
}

impl From<shell::exit::Failure> for Failure {
    fn from(failure: shell::exit::Failure) -> Failure {
        let message = failure.to_string();
        match failure.exit_code() {
            3 => Failure::input(message),
            4 => Failure::network(message),
            _ => Failure::runtime(message),
        }
    }
}

/// Failures of writing to standard output.
impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Failure {
        if error.kind() == io::ErrorKind::BrokenPipe {
            // The reader closed the output, which is not an error.
            Failure { exit_code: 0, messages: Vec::new() }
        } else {
            Failure::runtime(format!("cannot write the output: {error}"))
        }
    }
}

impl From<serde_json::Error> for Failure {
    fn from(error: serde_json::Error) -> Failure {
        Failure::from(io::Error::from(error))
    }
}
