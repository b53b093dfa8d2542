//! Missing parts of a recording.

use std::fmt;

use vocabulary::{RunId, Step};

/// Why a process cannot be replayed, or not to its end.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Shortfall {
    /// The recording has no process of the module.
    NoInputs,
    /// The process had started before, and its start is not recorded.
    StartMissing,
    /// The process had started before, and its recorded state cannot be used.
    State(String),
    /// The module's configuration is not recorded or cannot be used.
    Configuration(String),
    /// Inputs are missing.
    InputsMissing {
        /// The first.
        from: u64,
        /// The last.
        to: u64,
    },
    /// Samples that the process used are missing.
    SamplesMissing {
        /// Their run.
        run: RunId,
        /// The first.
        from: Step,
        /// The last.
        to: Step,
    },
    /// Which sample the process used next is not recorded.
    UnknownSample {
        /// The number of samples before it.
        samples: u64,
    },
    /// An input states another position than the samples before it.
    Contradiction {
        /// The input.
        number: u64,
        /// What is wrong.
        problem: String,
    },
}

impl Shortfall {
    /// A setup that no diagnoser accepts.
    pub(crate) fn of_setup(problems: &[diagnosis::SetupError]) -> Shortfall {
        let problems: Vec<String> = problems.iter().map(ToString::to_string).collect();
        Shortfall::Configuration(problems.join("; "))
    }
}

impl fmt::Display for Shortfall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Shortfall::NoInputs => f.write_str(
                "the inputs of its processes are not in the recording: use one made by `trusswatch record`",
            ),
            Shortfall::StartMissing => f.write_str(
                "the recording begins after the process had started, without its state: nothing can be verified before its next start",
            ),
            Shortfall::State(problem) => write!(
                f,
                "the recording begins after the process had started, and its state cannot be used: {problem}"
            ),
            Shortfall::Configuration(problem) => write!(f, "its configuration: {problem}"),
            Shortfall::InputsMissing { from, to } if from == to => {
                write!(f, "input {from} is missing")
            }
            Shortfall::InputsMissing { from, to } => write!(f, "inputs {from}–{to} are missing"),
            Shortfall::SamplesMissing { run, from, to } if from == to => {
                write!(f, "sample {from} of run {run}, which it used, is not in the recording")
            }
            Shortfall::SamplesMissing { run, from, to } => {
                write!(f, "samples {from}–{to} of run {run}, which it used, are not in the recording")
            }
            Shortfall::UnknownSample { samples } => write!(
                f,
                "the recording does not say which sample it used after the first {samples}"
            ),
            Shortfall::Contradiction { number, problem } => {
                write!(f, "input {number} contradicts the inputs before it: {problem}")
            }
        }
    }
}
