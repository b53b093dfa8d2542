//! What a recording lacks.

use std::fmt;

use vocabulary::{RunId, Step};

/// Why a process cannot be replayed, or not to its end.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Shortfall {
    /// No process of the module is known.
    NoInputs,
    /// The process had started before, and what it started with is not there.
    StartMissing,
    /// The process had started before, and the state that is there instead cannot be used.
    State(String),
    /// What the module was set up with is not there, or cannot be used.
    Configuration(String),
    /// Inputs are not there.
    InputsMissing {
        /// The first.
        from: u64,
        /// The last.
        to: u64,
    },
    /// Samples that were taken are not there.
    SamplesMissing {
        /// Their run.
        run: RunId,
        /// The first.
        from: Step,
        /// The last.
        to: Step,
    },
    /// A sample was taken, but not which one is said.
    UnknownSample {
        /// After so many samples.
        samples: u64,
    },
    /// The position that an input tells is another one.
    Contradiction {
        /// The input.
        number: u64,
        /// What is wrong.
        problem: String,
    },
}

impl Shortfall {
    /// No diagnoser can be made of a setup.
    pub(crate) fn of_setup(problems: &[diagnosis::SetupError]) -> Shortfall {
        let problems: Vec<String> = problems.iter().map(ToString::to_string).collect();
        Shortfall::Configuration(problems.join("; "))
    }
}

impl fmt::Display for Shortfall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Shortfall::NoInputs => f.write_str(
                "what its processes took beside samples is not in the recording: use one made by `trusswatch record`",
            ),
            Shortfall::StartMissing => f.write_str(
                "the recording begins after the process had started, and does not have its state: nothing of it can be verified before its next start",
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
                write!(f, "sample {from} of run {run} that it took is not in the recording")
            }
            Shortfall::SamplesMissing { run, from, to } => {
                write!(f, "samples {from}–{to} of run {run} that it took are not in the recording")
            }
            Shortfall::UnknownSample { samples } => write!(
                f,
                "which sample it took after the first {samples} is not in the recording"
            ),
            Shortfall::Contradiction { number, problem } => {
                write!(f, "input {number} does not fit what precedes it: {problem}")
            }
        }
    }
}
