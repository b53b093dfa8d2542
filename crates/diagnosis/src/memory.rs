//! The state that a diagnoser had before it was restarted.

pub use vocabulary::PastWatch;

use crate::verdict::Transition;

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
