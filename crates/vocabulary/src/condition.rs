//! What the comparison of a component with its reference says.

use std::fmt;

use crate::{ComponentPath, Step};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The condition of a component as of the latest comparison with its reference: what it measures while it is healthy.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "agreement", rename_all = "snake_case")]
pub enum Condition {
    /// There is no reference, so its condition is unknown.
    NotVerified,
    /// It has not been compared yet.
    NotCompared,
    /// It agrees with its reference.
    Agrees {
        /// The first step of the window that was compared: the agreement says nothing of a fault that was found later.
        #[serde(rename = "from_step")]
        from: Step,
        /// The last step of the window that was compared.
        #[serde(rename = "as_of_step")]
        as_of: Step,
    },
    /// It departed from its reference in the latest window. The next one will tell.
    Doubtful {
        /// The last step of that window.
        #[serde(rename = "as_of_step")]
        as_of: Step,
    },
    /// It has departed from its reference.
    Departed {
        /// The last step of the latest window in which it did.
        #[serde(rename = "as_of_step")]
        as_of: Step,
    },
    /// It or another of these has.
    OneOf {
        /// The last step of the latest window.
        #[serde(rename = "as_of_step")]
        as_of: Step,
        /// Those that may be meant, itself included, the likeliest first.
        components: Vec<ComponentPath>,
    },
    /// It cannot be compared at present.
    CannotTell {
        /// Why.
        obstacle: Obstacle,
    },
}

/// Why a component cannot be compared with its reference.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Obstacle {
    /// The structure swings more than it did during commissioning.
    Swinging,
    /// The force of this cylinder is beyond what was seen during commissioning.
    UnseenForce(ComponentPath),
    /// No small set of displaced gages explains what is measured.
    NoSetFits,
    /// Of a learned module: no input has a signal, or the loads are beyond those of the healthy recordings.
    UnseenLoads,
    /// Of a learned module: several channels depart, or the structure itself has changed.
    NoFewChannels,
    /// Of a learned module: the channel is missing, constant or implausible.
    NoSignal,
}

impl Condition {
    /// May a component of which nothing else is known be called normal?
    #[must_use]
    pub fn allows_normal(&self) -> bool {
        matches!(self, Condition::NotVerified | Condition::Agrees { .. })
    }

    /// In words, what keeps the component from being normal.
    #[must_use]
    pub fn reason(&self) -> Option<String> {
        match self {
            Condition::NotVerified | Condition::Agrees { .. } => None,
            Condition::NotCompared => Some("not compared with its reference yet".to_owned()),
            Condition::Doubtful { .. } => {
                Some("it departed from its reference in the latest window".to_owned())
            }
            Condition::Departed { .. } => Some("it departs from its reference".to_owned()),
            Condition::OneOf { components, .. } => {
                let names: Vec<String> = components.iter().map(ToString::to_string).collect();
                Some(format!("one of these departs from its reference: {}", names.join(", ")))
            }
            Condition::CannotTell { obstacle } => {
                Some(format!("it cannot be compared: {obstacle}"))
            }
        }
    }
}

impl fmt::Display for Obstacle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Obstacle::Swinging => {
                f.write_str("the structure swings more than during commissioning")
            }
            Obstacle::UnseenForce(actuator) => {
                write!(f, "the force of {actuator} is beyond what was seen during commissioning")
            }
            Obstacle::NoSetFits => {
                f.write_str("more departs from the reference than a few gages explain")
            }
            Obstacle::UnseenLoads => {
                f.write_str("the loads are unknown, or beyond those of the healthy recordings")
            }
            Obstacle::NoFewChannels => {
                f.write_str("several channels depart, or the structure itself has changed")
            }
            Obstacle::NoSignal => f.write_str("it is missing, constant or implausible"),
        }
    }
}
