//! Configuration files: read, checked, and every mistake reported at once.

mod diagnoser;
mod document;
mod endpoint;
mod error;
mod flags;
mod health;
mod identity;
mod method;
mod network;
mod plant;
mod schedule;
mod speed;

pub use diagnoser::{
    DiagnoserConfig, InputSettings, PublishSettings, QuerySettings, StateSettings, Uncalibrated,
    load_diagnoser, load_uncalibrated,
};
pub use endpoint::{EndpointError, endpoint};
pub use error::{ConfigError, ConfigErrors};
pub use flags::{NetworkFlags, PlantFlags};
pub use health::{HealthFlags, HealthSettings};
pub use identity::mistake;
pub use method::{DetectionSection, IsolationSection};
pub use network::{Mode, Network};
pub use plant::{LockStep, MismatchSection, PlantConfig, load_plant};
pub use schedule::{Schedule, ScheduledFault, load_schedule};
pub use speed::{Speed, SpeedError};
