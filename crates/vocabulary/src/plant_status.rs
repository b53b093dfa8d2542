//! How the plant is.

use crate::{ComponentPath, ModuleName, RunId, Step, StructureName};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::Message;
use crate::fault::Fault;

/// What the plant is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlantPhase {
    /// Modules are missing that it was configured to wait for.
    Waiting,
    /// Steps are being computed.
    Running,
    /// The last step is done.
    Done,
}

/// The plant's status, once a second.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlantStatus {
    /// The structure.
    pub structure: StructureName,
    /// Version of the software.
    pub software: String,
    /// The present run.
    pub run: RunId,
    /// What it is doing.
    pub phase: PlantPhase,
    /// Modules that it is waiting for before step 0.
    pub waiting_for: Vec<ModuleName>,
    /// The next step to be computed.
    pub next_step: Step,
    /// Steps per second of simulated time, as a factor; `null` means as fast as possible.
    pub speed: Option<f64>,
    /// Steps computed more than a step's length too late (and caught up afterwards).
    pub late_steps: u64,
    /// The worst delay of a step \[ms\].
    pub latest_ms: f64,
    /// Samples that could not be handed to the network.
    pub samples_unsent: u64,
    /// Faults that are present.
    pub faults: Vec<PresentFault>,
    /// Components that its controller does without: gages whose corrected reading it uses, cylinders that the others make up
    /// for.
    #[serde(default)]
    pub done_without: Vec<ComponentPath>,
    /// Messages on its gages and cylinders that it could not use.
    #[serde(default)]
    pub messages_refused: u64,
    /// When this was published \[ns since 1970\].
    pub time_unix_ns: u64,
}

/// A fault that is present.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PresentFault {
    /// The component.
    pub component: ComponentPath,
    /// Its fault.
    pub fault: Fault,
}

impl Message for PlantStatus {
    const WHAT: &'static str = "plant status";
}
