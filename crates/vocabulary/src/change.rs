//! A divergence crossed its threshold.

use crate::{Component, ComponentPath, RunId, Step, StructureName};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::Message;
use crate::evidence::Evidence;

/// A channel changed; nothing is said yet about whose fault it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ChangeReport {
    /// The structure.
    pub structure: StructureName,
    /// The component whose channel changed.
    pub component: ComponentPath,
    /// The run that the step is counted in.
    pub run: RunId,
    /// The step at which the divergence reached its threshold.
    pub step: Step,
    /// The channel at that step.
    pub evidence: Evidence,
    /// When this was published \[ns since 1970\].
    pub time_unix_ns: u64,
}

/// A change as modules tell each other.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Change {
    /// The component whose channel changed.
    pub component: Component,
    /// Since when its residual may have been changing.
    #[serde(rename = "onset_step")]
    pub onset: Step,
    /// The step at which D rose to γ or above, or at which a faulty component was seen to have shifted across a gap.
    pub step: Step,
    /// Largest D/γ from that step until the tie window was over (or until the step asked for), less what a cylinder's
    /// demand explains of it; 1 if that is all.
    pub ratio: f64,
    /// The last step at which D was at γ or above, once the channel is quiet; `null` while it is not.
    #[serde(rename = "until_step")]
    pub until: Option<Step>,
}

impl Change {
    /// One that begins and ends with this step.
    #[must_use]
    pub fn at(component: Component, step: Step, ratio: f64) -> Self {
        Self { component, onset: step, step, ratio, until: Some(step) }
    }
}

impl Message for ChangeReport {
    const WHAT: &'static str = "change message";
}
