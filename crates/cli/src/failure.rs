//! How a command ends when it does not end well: an exit code and lines on standard error.

use std::io::{self, Write};
use std::process::ExitCode;

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
  130  interrupted before it was done";

/// Kinds of failure, each with its exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// The reader closed the output. Not an error.
    OutputClosed,
    /// The operation failed.
    Runtime,
    /// Invalid arguments.
    Usage,
    /// A file that cannot be used.
    Input,
    /// The network.
    Network,
    /// Done, but not saved.
    NotSaved,
    /// A signal ended it early.
    Interrupted,
}

impl Kind {
    fn exit_code(self) -> u8 {
        match self {
            Kind::OutputClosed => 0,
            Kind::Runtime => 1,
            Kind::Usage => 2,
            Kind::Input => 3,
            Kind::Network => 4,
            Kind::NotSaved => 5,
            Kind::Interrupted => 130,
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

    /// The operation failed.
    pub(crate) fn runtime(message: impl Into<String>) -> Failure {
        Failure::new(Kind::Runtime, message)
    }

    /// The operation failed, and the reason was printed already.
    pub(crate) fn reported() -> Failure {
        Failure { kind: Kind::Runtime, messages: Vec::new() }
    }

    /// A signal ended it before it was done.
    pub(crate) fn interrupted(message: impl Into<String>) -> Failure {
        Failure::new(Kind::Interrupted, message)
    }

    /// Invalid arguments.
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

    /// The operation failed, for each of these reasons.
    pub(crate) fn runtimes(messages: Vec<String>) -> Failure {
        Failure { kind: Kind::Runtime, messages }
    }

    /// Done, but not saved, for each of these reasons.
    pub(crate) fn not_saved(messages: Vec<String>) -> Failure {
        Failure { kind: Kind::NotSaved, messages }
    }

    /// The network, for each of these reasons.
    pub(crate) fn networks(messages: Vec<String>) -> Failure {
        Failure { kind: Kind::Network, messages }
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
        ExitCode::from(self.kind.exit_code())
    }
}

/// Failures of writing to standard output.
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
