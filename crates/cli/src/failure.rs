//! How a command ends when it does not end well: an exit code and lines on standard error.

use std::io::{self, Write};
use std::process::ExitCode;

/// What `--help` says about exit codes.
pub(crate) const EXIT_CODES: &str = "\
Exit codes:
  0  done
  1  it did not work out; of the demo: injected and diagnosed faults differ; of an order: refused;
     of faults --check and health: not all is well
  2  wrong use of the command line
  3  a file that cannot be used
  4  the network, or nobody answers";

/// Kinds of failure, each with its exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Whoever read the output has had enough. Not an error.
    OutputClosed,
    /// It did not work out.
    Runtime,
    /// Arguments that cannot be meant.
    Usage,
    /// A file that cannot be used.
    Input,
    /// The network.
    Network,
}

impl Kind {
    fn exit_code(self) -> u8 {
        match self {
            Kind::OutputClosed => 0,
            Kind::Runtime => 1,
            Kind::Usage => 2,
            Kind::Input => 3,
            Kind::Network => 4,
        }
    }
}

/// Why a command failed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Failure {
    kind: Kind,
    messages: Vec<String>,
}

impl Failure {
    fn new(kind: Kind, message: impl Into<String>) -> Failure {
        Failure { kind, messages: vec![message.into()] }
    }

    /// It did not work out.
    pub(crate) fn runtime(message: impl Into<String>) -> Failure {
        Failure::new(Kind::Runtime, message)
    }

    /// It did not work out, and everything to be said was said.
    pub(crate) fn told() -> Failure {
        Failure { kind: Kind::Runtime, messages: Vec::new() }
    }

    /// Arguments that cannot be meant.
    pub(crate) fn usage(message: impl Into<String>) -> Failure {
        Failure::new(Kind::Usage, message)
    }

    /// A file that cannot be used.
    pub(crate) fn input(message: impl Into<String>) -> Failure {
        Failure::new(Kind::Input, message)
    }

    /// Files that cannot be used, for each of these reasons.
    pub(crate) fn inputs(messages: Vec<String>) -> Failure {
        Failure { kind: Kind::Input, messages }
    }

    /// The network.
    pub(crate) fn network(message: impl Into<String>) -> Failure {
        Failure::new(Kind::Network, message)
    }

    /// It did not work out, for each of these reasons.
    pub(crate) fn runtimes(messages: Vec<String>) -> Failure {
        Failure { kind: Kind::Runtime, messages }
    }

    /// The network, for each of these reasons.
    pub(crate) fn networks(messages: Vec<String>) -> Failure {
        Failure { kind: Kind::Network, messages }
    }

    /// Says on standard error what there is to say.
    pub(crate) fn report(&self) -> ExitCode {
        let mut stderr = io::stderr().lock();
        for message in &self.messages {
            // Nobody is left to be told if standard error is closed too.
            let _ = writeln!(stderr, "error: {message}");
        }
        ExitCode::from(self.kind.exit_code())
    }
}

/// Failures of writing to standard output.
impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Failure {
        if error.kind() == io::ErrorKind::BrokenPipe {
            Failure { kind: Kind::OutputClosed, messages: Vec::new() }
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
