//! The verdict of a module on one of its components.

use std::fmt;

use crate::{ComponentPath, ModuleName, Step};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::tagged_by_word;
use crate::fault_state::FaultState;

/// The verdict of a module on one of its components.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum Verdict {
    /// No change, or an explained change has ended.
    Normal,
    /// A change, not yet judged.
    Tentative,
    /// A change that cannot be judged.
    Unconfirmed {
        /// Why.
        #[serde(flatten, deserialize_with = "tagged_by_word")]
        doubt: Doubt,
    },
    /// A change that another component's fault explains.
    Explained {
        /// The component that changed first.
        #[serde(rename = "explained_by")]
        by: ComponentPath,
        /// When it changed.
        #[serde(rename = "explained_since_step")]
        since: Step,
    },
    /// A fault of this component; stays until reset.
    Latched,
    /// A fault of this component that an operator has seen; stays until reset.
    Acknowledged,
    /// In place of *normal* in replies, while the module does not monitor the component or cannot compare it with its
    /// reference. No transition leads here, and no diagnoser gives it.
    Unknown,
}

/// Why a change cannot be judged.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "doubt", content = "of", rename_all = "snake_case")]
pub enum Doubt {
    /// These peers do not answer. They are asked again.
    Silent(Vec<ModuleName>),
    /// These modules, perhaps this one, were not watching when it happened: it can never be judged.
    Unknowing(Vec<ModuleName>),
    /// The residual rests on the force that is assumed of this actuator, which has no signal.
    Assumed(ComponentPath),
    /// One of these has departed from its reference, itself included, the likeliest first. More answers, or more load, may tell.
    OneOf(Vec<ComponentPath>),
    /// The run ended before the judgement.
    RunEnded,
}

impl Doubt {
    /// Will there be no verdict any more?
    #[must_use]
    pub fn is_final(&self) -> bool {
        !matches!(self, Doubt::Silent(_) | Doubt::OneOf(_))
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = |modules: &[ModuleName]| {
            modules.iter().map(ModuleName::as_str).collect::<Vec<_>>().join(", ")
        };
        match self {
            Doubt::Silent(modules) => write!(f, "no usable answer from {}", list(modules)),
            Doubt::Unknowing(modules) => write!(f, "not watched at the time by {}", list(modules)),
            Doubt::Assumed(actuator) => {
                write!(f, "it depends on the force of {actuator}, which has no signal")
            }
            Doubt::OneOf(components) => {
                let all: Vec<String> = components.iter().map(ToString::to_string).collect();
                write!(f, "one of {}", all.join(", "))
            }
            Doubt::RunEnded => f.write_str("the run ended before it was judged"),
        }
    }
}

impl Verdict {
    /// A fault of this very component, acknowledged or not.
    #[must_use]
    pub fn is_latched(&self) -> bool {
        matches!(self, Verdict::Latched | Verdict::Acknowledged)
    }

    /// A change that will never be judged.
    #[must_use]
    pub fn is_undecidable(&self) -> bool {
        matches!(self, Verdict::Unconfirmed { doubt } if doubt.is_final())
    }

    /// The component that changed first, if that explains the change.
    #[must_use]
    pub fn explained_by(&self) -> Option<&ComponentPath> {
        match self {
            Verdict::Explained { by, .. } => Some(by),
            _ => None,
        }
    }

    /// Why the change cannot be judged, if so.
    #[must_use]
    pub fn doubt(&self) -> Option<&Doubt> {
        match self {
            Verdict::Unconfirmed { doubt } => Some(doubt),
            _ => None,
        }
    }

    /// Its word.
    #[must_use]
    pub fn state(&self) -> FaultState {
        match self {
            Verdict::Normal => FaultState::Normal,
            Verdict::Tentative => FaultState::Tentative,
            Verdict::Unconfirmed { .. } => FaultState::Unconfirmed,
            Verdict::Explained { .. } => FaultState::Explained,
            Verdict::Latched => FaultState::Latched,
            Verdict::Acknowledged => FaultState::Acknowledged,
            Verdict::Unknown => FaultState::Unknown,
        }
    }

    /// One with this word, for tests: unconfirmed since the run ended, explained by another component.
    #[must_use]
    pub fn example(state: FaultState) -> Verdict {
        match state {
            FaultState::Normal => Verdict::Normal,
            FaultState::Tentative => Verdict::Tentative,
            FaultState::Unconfirmed => Verdict::Unconfirmed { doubt: Doubt::RunEnded },
            FaultState::Explained => match "module1/actuator/a1".parse() {
                Ok(by) => Verdict::Explained { by, since: Step(0) },
                Err(_) => Verdict::Tentative,
            },
            FaultState::Latched => Verdict::Latched,
            FaultState::Acknowledged => Verdict::Acknowledged,
            FaultState::Unknown => Verdict::Unknown,
        }
    }

    /// Its word, as on the wire.
    #[must_use]
    pub fn as_str(&self) -> &'static str {
        self.state().as_str()
    }
}
