//! A divergence crossed its threshold.

use names::{ComponentPath, RunId, Step, StructureName};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::Message;
use crate::evidence::Evidence;

/// A channel changed; nothing is said yet about whose fault it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Change {
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

impl Message for Change {
    const WHAT: &'static str = "change message";
}
