//! Reads and checks configuration files; reports all errors at once.

mod diagnoser;
mod plant;
mod schedule;
mod speed;

pub use diagnoser::{
    DiagnoserConfig, InputSettings, ModuleTolerance, PublishSettings, QuerySettings, StateSettings,
    Uncalibrated, load_diagnoser, load_learned, load_reference, load_uncalibrated,
};
pub use plant::{LockStep, MismatchSection, PlantConfig, PlantFlags, load_plant};
pub use schedule::{Schedule, ScheduledFault, load_schedule};
pub use speed::{Speed, SpeedError};
