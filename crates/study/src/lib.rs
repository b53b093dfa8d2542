//! Campaigns in one process on a virtual clock: the same diagnosers and the same plant as in the daemons, with queries
//! answered at once.

mod calibration;
mod campaign;
mod case;
pub mod commissioning;
pub mod conditions;
mod draw;
mod engine;
mod error;
mod explain;
mod export;
pub mod figure;
mod group;
pub mod identification;
pub mod journal;
pub mod limits;
pub mod parallel;
pub mod report;
mod rig;
pub mod rivals;
pub mod scenarios;
mod statistics;
mod system;
pub mod tail;
pub mod tolerance;
pub mod trace;

pub use calibration::{
    Calibration, ChannelPeaks, EffectRuns, Effects, ModulePeaks, NominalRuns, ResidualRecording,
    StepOrder, plant,
};
pub use campaign::{Campaign, Rows};
pub use case::{CampaignCase, CaseRun, SampleGap, Watch};
pub use engine::{Begin, Engine, EngineWork, Shard};
pub use error::StudyError;
pub use explain::{CaseExplanation, LineKind, StoryLine, explain};
pub use export::{RecordedChange, export};
pub use group::{Diagnosed, DiagnoserGroup, GroupError, Identify, RigEvent};
pub use journal::Done;
pub use rig::{Rig, RigError, TimedFault};
pub use statistics::{Delays, Interval95, rate_interval, share_interval};
pub use system::{
    CommissionedPlant, ControllerTuning, PlantRow, ReferenceRow, System, missing_cylinder_size,
    module_setups,
};
