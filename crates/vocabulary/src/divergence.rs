//! A module's divergences at one step.

use crate::{Component, ModuleName, RunId, Step, StructureName};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::Message;

/// All channels of a module at one step. Published every so many steps, and at each change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Divergences {
    /// The structure.
    pub structure: StructureName,
    /// The module.
    pub module: ModuleName,
    /// The run that the step is counted in.
    pub run: RunId,
    /// The step.
    pub step: Step,
    /// When this was published \[ns since 1970\].
    pub time_unix_ns: u64,
    /// Actuators, then gages, in the order of the description.
    pub channels: Vec<Channel>,
}

/// One channel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Channel {
    /// The component that it watches.
    pub component: Component,
    /// The residual, as in [`crate::Evidence`].
    pub residual: f64,
    /// The divergence; `null` while undefined.
    pub divergence: Option<f64>,
    /// Its threshold.
    pub threshold: f64,
    /// The residual has the unit of the channel's reading, which is unknown: true in a learned module.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub own_unit: bool,
}

impl Message for Divergences {
    const WHAT: &'static str = "divergence message";
}
