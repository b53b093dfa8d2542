//! Queries between modules: "your changes from step a, as of step b?"
//!
//! An answer is a statement about steps, not about the moment it is given: a peer that has not yet
//! processed step b holds its answer until it has. The verdicts of the modules together are then those
//! of one process, whatever the network's timing.

use vocabulary::{ActuatorFault, Alarm, RunId, Step};

use crate::state::{WindowLength, WindowMeans};
use vocabulary::Change;

/// Most changes that one answer may carry.
pub const MAX_CHANGES_IN_ANSWER: usize = 4096;

/// A question to a peer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Question {
    /// The run that the steps are counted in.
    pub run: RunId,
    /// First step of interest.
    pub from: Step,
    /// The step as of which the answer is wanted, itself included.
    pub as_of: Step,
    /// Are the means of the window that ended with that step wanted, and of which length?
    pub window: Option<WindowLength>,
}

/// A peer's answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// The question that is answered.
    pub question: Question,
    /// Since which step every channel has been watched; `None` while initialising.
    pub watching_since: Option<Step>,
    /// Changes that had begun by the second step of the question and were not over before the first, oldest
    /// first.
    pub changes: Vec<Change>,
    /// Actuators declared faulty as of the step asked for, whenever that was found.
    pub actuator_faults: Vec<ActuatorFault>,
    /// The components for which it raises the alarm as of the step asked for.
    pub alarms: Vec<Alarm>,
    /// The means of the window that ended with the step asked for, if they are wanted and there are any.
    pub window: Option<WindowMeans>,
}

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
