//! How a question to a peer ([`vocabulary::StateQuestion`]) fails.

use vocabulary::{RunId, Step};

/// Most changes that one answer may carry.
pub const MAX_CHANGES_IN_ANSWER: usize = 4096;

/// How a question went unanswered.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PeerFailure {
    /// The peer refused, with its reason.
    #[error("refused: {0}")]
    Refused(String),
    /// No answer in time.
    #[error("timed out")]
    TimedOut,
    /// No peer is there to answer.
    #[error("absent")]
    Absent,
    /// The answer does not fit the question.
    #[error("answer malformed: {0}")]
    Malformed(String),
}

/// Why this module does not answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// The question names another run.
    #[error("run {asked} is not the present run {present}")]
    OtherRun {
        /// The run asked about.
        asked: RunId,
        /// The run being diagnosed.
        present: RunId,
    },
    /// No sample has come yet.
    #[error("no sample yet")]
    NoSample,
    /// Too many questions are waiting.
    #[error("{0} questions are waiting already")]
    TooMany(usize),
    /// The step asked for is so far ahead that it cannot belong to this run.
    #[error("step {asked} is too far ahead of step {present}")]
    TooFarAhead {
        /// The step asked for.
        asked: Step,
        /// The latest step processed.
        present: Step,
    },
}
