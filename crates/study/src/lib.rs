//! Campaigns in one process on a virtual clock: the same diagnosers as in the daemons, fed by the same
//! plant, with questions answered at once.

mod calibration;
mod campaign;
mod closest;
pub mod commissioning;
pub mod conditions;
mod controller;
mod error;
mod explain;
mod export;
pub mod figure;
pub mod histories;
pub mod identification;
pub mod limits;
pub mod parallel;
mod power;
mod power_study;
mod quantile;
mod recollection;
mod record;
pub mod report;
mod rig;
mod scenario;
mod schedule;
pub mod summary;
pub mod tail;
pub mod trace;
mod truth;

pub use calibration::{
    Calibration, ChannelPeaks, ModulePeaks, NominalRuns, Recording, StepOrder, plant,
};
pub use campaign::Campaign;
pub use closest::Closest;
pub use controller::Controller;
pub use error::StudyError;
pub use explain::{Explanation, Line, LineKind, explain};
pub use export::{Exported, RecordedChange, export_nominal, export_scenario};
pub use power::{PowerCurve, PowerPoint};
pub use power_study::{SizedFault, measure_power};
pub use record::{Confusion, Conversation, Diagnosed, NominalRecord, ScenarioRecord};
pub use rig::{Occurrence, Rig, RigError};
pub use scenario::{Scenario, ScenarioRanges, nominal_seed};
pub use schedule::{Injection, Schedule};
pub use summary::Summary;
pub use truth::TruthIndex;
