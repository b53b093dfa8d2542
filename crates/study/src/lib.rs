//! Campaigns in one process on a virtual clock: the same diagnosers as in the daemons, fed by the same
//! plant, with questions answered at once.

mod calibration;
mod rig;
mod schedule;

pub use calibration::{Calibration, largest_divergences};
pub use rig::{Occurrence, Rig, RigError};
pub use schedule::{Injection, Schedule};
