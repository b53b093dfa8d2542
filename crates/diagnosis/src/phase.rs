//! Whether verdicts can be given yet.

use serde::{Deserialize, Serialize};
use vocabulary::Step;

/// The phase a diagnoser is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "phase", rename_all = "snake_case")]
pub enum Phase {
    /// No sample yet.
    Waiting,
    /// Some channel cannot be judged: its Gaussian rests on too few vectors, or samples are missing and
    /// there is no whole vector since.
    Initialising,
    /// Every channel is watched.
    InService {
        /// Since this step.
        since: Step,
    },
}

impl Phase {
    /// The name as on the wire.
    #[must_use]
    pub fn as_str(&self) -> &'static str {
        match self {
            Phase::Waiting => "waiting",
            Phase::Initialising => "initialising",
            Phase::InService { .. } => "in_service",
        }
    }
}
