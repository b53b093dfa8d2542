//! How far a module has come.

use crate::{RunId, Step};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::Message;

/// The module has processed everything up to this step. A plant that runs as fast as it can waits
/// for this, so that nothing is dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Progress {
    /// The run that the step is counted in.
    pub run: RunId,
    /// The latest step processed.
    pub step: Step,
}

impl Message for Progress {
    const WHAT: &'static str = "progress message";
}
