//! The state that a diagnoser had before it was restarted.

use vocabulary::{RunId, Step};

use crate::verdict::Transition;
use vocabulary::Change;

/// The state that survives a restart. The shell stores it and passes it to
/// [`crate::Diagnoser::recall`] before the first event.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Memory {
    /// The sequence number of the latest transition; 0 if there was none.
    pub sequence: u64,
    /// The latest transition of each component that had one.
    pub latest: Vec<Transition>,
    /// The run being diagnosed, and what was watched of it.
    pub watch: Option<PastWatch>,
}

/// What was watched of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct PastWatch {
    /// The run.
    pub run: RunId,
    /// First and last step that every channel was watched at, if there was one.
    pub watched: Option<(Step, Step)>,
    /// The changes of the run as [`crate::Action::Settled`] reported them, in that order. Of a change that was
    /// reported twice the later report counts.
    pub changes: Vec<Change>,
}
