//! The kind of component that a message says it is about.

use names::ComponentKind;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::later_words;

/// The kind of a component as a message states it. The name of the component says it as well, and counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "ComponentKind", transform = later_words::open)]
pub enum StatedKind {
    /// A hydraulic actuator.
    Actuator,
    /// A strain gage.
    Sensor,
    /// A word of a later version.
    #[serde(other)]
    Other,
}

impl From<ComponentKind> for StatedKind {
    fn from(kind: ComponentKind) -> Self {
        match kind {
            ComponentKind::Actuator => StatedKind::Actuator,
            ComponentKind::Sensor => StatedKind::Sensor,
        }
    }
}
