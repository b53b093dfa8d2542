//! What is known of a component's health.

use std::fmt;

use vocabulary::{ComponentPath, Step};

/// The condition of a component as of the latest comparison with its reference.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Condition {
    /// There is no reference: nobody knows whether it is healthy.
    NotVerified,
    /// It has not been compared yet.
    NotCompared,
    /// It agrees with its reference.
    Agrees {
        /// The last step of the window.
        as_of: Step,
    },
    /// It departed from its reference in the latest window. One more will tell.
    Doubtful {
        /// The last step of the window.
        as_of: Step,
    },
    /// It has departed from its reference.
    Departed {
        /// The last step of the latest window that it did in.
        as_of: Step,
    },
    /// It or another of these has.
    OneOf {
        /// The last step of the latest window.
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

/// Why nothing can be said.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Obstacle {
    /// The structure swings more than it did during commissioning.
    Swinging,
    /// A cylinder's force is beyond what was seen during commissioning.
    UnseenForce(ComponentPath),
    /// No small set of displaced gages explains what is measured.
    NoSetFits,
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
        }
    }
}
