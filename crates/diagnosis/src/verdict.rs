//! The life of a verdict on one component.

use serde::{Deserialize, Serialize};
use truss::ids::{Component, ComponentPath, ModuleName, RunId, Step};

use crate::evidence::Evidence;

/// What a module holds of one of its components.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum Verdict {
    /// No change, or the explained one is over.
    Normal,
    /// A change, not yet judged.
    Tentative,
    /// A change that cannot be judged because peers do not answer.
    Unconfirmed {
        /// The peers without whose answers nothing can be said.
        silent: Vec<ModuleName>,
    },
    /// A change that another component's fault explains.
    Explained {
        /// The component that changed first.
        by: ComponentPath,
        /// When it changed.
        since: Step,
    },
    /// A fault of this component; stays until reset.
    Latched,
}

impl Verdict {
    /// A fault of this very component.
    #[must_use]
    pub fn is_latched(&self) -> bool {
        matches!(self, Verdict::Latched)
    }

    /// The state's name as on the wire.
    #[must_use]
    pub fn as_str(&self) -> &'static str {
        match self {
            Verdict::Normal => "normal",
            Verdict::Tentative => "tentative",
            Verdict::Unconfirmed { .. } => "unconfirmed",
            Verdict::Explained { .. } => "explained",
            Verdict::Latched => "latched",
        }
    }
}

/// One numbered step in the life of a verdict.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    /// Counts the transitions of this module from 1, without a gap.
    pub sequence: u64,
    /// The run that the steps are counted in.
    pub run: RunId,
    /// The component.
    pub component: Component,
    /// The new verdict.
    pub verdict: Verdict,
    /// Since when the residual has been changing, as far back as the divergence shows it.
    pub onset: Step,
    /// When the divergence reached its threshold.
    pub detection: Step,
    /// As of which step the verdict was found.
    pub decided: Step,
    /// The channel at the detection.
    pub evidence: Evidence,
}
