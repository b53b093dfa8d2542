//! Runs in which something is wrong that no change shows: from the start, after a gap, creeping, behind another fault.

mod campaign;
mod draw;
mod run;
mod tally;

pub use campaign::{CommissionedPlant, ConditionCampaign};
pub use draw::{Blind, Case, CaseKind, Situation};
pub(crate) use run::standing;
pub use run::{CaseRecord, Standing, run_case};
pub use tally::{SituationTally, tally};
