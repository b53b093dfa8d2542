//! Health and metrics over HTTP, on an address that is given for it; without one there is nothing of this.
//!
//! | file | job |
//! |---|---|
//! | `condition` | `/healthz` and `/readyz`: whether the loop comes round, whether it does what it is for |
//! | `metrics` | `/metrics`: the status in the text format of OpenMetrics |
//! | `module`, `plant` | what there is to say of a diagnoser, of a plant |
//! | `server` | HTTP, on a thread of its own, for a few at a time |
//! | `probe` | the same from outside, for containers without `curl` |
//!
//! Whoever asks reads what was written down anyway: nothing here asks anything of the diagnosis, and
//! nothing that a client does can hold it up.

mod condition;
mod metrics;
mod module;
mod plant;
mod probe;
mod server;

pub(crate) use metrics::{ComponentReport, ModuleReport};
pub(crate) use module::{ModuleBoard, ModuleHealth};
pub(crate) use plant::PlantHealth;
pub use probe::{Probe, ProbeError, Wanted};
pub(crate) use server::Listening;

use condition::Condition;

/// Whose health it is.
pub(crate) trait Subject: Send + Sync + 'static {
    /// Does its loop come round?
    fn live(&self) -> Condition;
    /// Does it do what it is for?
    fn ready(&self) -> Condition;
    /// Everything that it counts, in the text format of OpenMetrics.
    fn metrics(&self) -> Result<String, std::fmt::Error>;
}
