//! One transition of the verdict on a component.

use std::fmt;

use serde::{Deserialize, Serialize};
use truss::ids::{ComponentKind, ComponentPath, ModuleName, RunId, Step, StructureName};

use crate::encoding::Message;
use crate::evidence::Evidence;

/// What a module holds of one of its components.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultState {
    /// No change, or the explained one is over.
    Normal,
    /// A change, not yet judged.
    Tentative,
    /// A change that cannot be judged because peers do not answer.
    Unconfirmed,
    /// A change that another component's fault explains.
    Explained,
    /// A fault of this component; stays until reset.
    Latched,
}

impl FaultState {
    /// The name in messages.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            FaultState::Normal => "normal",
            FaultState::Tentative => "tentative",
            FaultState::Unconfirmed => "unconfirmed",
            FaultState::Explained => "explained",
            FaultState::Latched => "latched",
        }
    }
}

impl fmt::Display for FaultState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// A transition, published when it happens and given to whoever asks for the present state.
///
/// In answer to a question, a component that has had no transition yet is `normal` with sequence 0
/// and without run, steps and evidence.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FaultTransition {
    /// The structure.
    pub structure: StructureName,
    /// The module.
    pub module: ModuleName,
    /// The component.
    pub component: ComponentPath,
    /// Actuator or sensor.
    pub kind: ComponentKind,
    /// The new state.
    pub state: FaultState,
    /// Counts the module's transitions from 1, without a gap.
    pub sequence: u64,
    /// The run that the steps are counted in.
    pub run: Option<RunId>,
    /// Since when the residual has been changing.
    pub onset_step: Option<Step>,
    /// When the divergence reached its threshold.
    pub detection_step: Option<Step>,
    /// As of which step the state was found.
    pub decided_step: Option<Step>,
    /// The channel at the detection.
    pub evidence: Option<Evidence>,
    /// If explained, the component that changed first.
    pub explained_by: Option<ComponentPath>,
    /// If explained, when that component changed.
    pub explained_since_step: Option<Step>,
    /// If unconfirmed, the modules without whose answers nothing can be said.
    #[serde(default)]
    pub silent: Vec<ModuleName>,
    /// When this was published \[ns since 1970\].
    pub time_unix_ns: u64,
}

impl Message for FaultTransition {
    const WHAT: &'static str = "fault transition";
}
