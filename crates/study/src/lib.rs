//! Campaigns in one process on a virtual clock: the same diagnosers as in the daemons, fed by the same
//! plant, with questions answered at once.

mod calibration;
mod error;
mod rig;
mod schedule;

pub use calibration::{Calibration, NominalRuns, plant};
pub use error::StudyError;
pub use rig::{Occurrence, Rig, RigError};
pub use schedule::{Injection, Schedule};
