//! What the comparison of a component with its reference says.

use crate::Step;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How a component stands to its reference: what it measures while it is healthy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Agreement {
    /// There is no reference: nobody knows whether it is healthy.
    NotVerified,
    /// It has not been compared yet.
    NotCompared,
    /// It agrees with its reference.
    Agrees,
    /// It departed from its reference in the latest window. The next one will tell.
    Doubtful,
    /// It has departed from its reference.
    Departed,
    /// It or another component has.
    OneOf,
    /// It cannot be compared at present.
    CannotTell,
}

impl Agreement {
    /// The name in messages.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Agreement::NotVerified => "not_verified",
            Agreement::NotCompared => "not_compared",
            Agreement::Agrees => "agrees",
            Agreement::Doubtful => "doubtful",
            Agreement::Departed => "departed",
            Agreement::OneOf => "one_of",
            Agreement::CannotTell => "cannot_tell",
        }
    }

    /// May a component of which nothing else is known be called normal?
    #[must_use]
    pub fn allows_normal(self) -> bool {
        matches!(self, Agreement::NotVerified | Agreement::Agrees)
    }
}

/// The condition of a component as of the latest comparison.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Condition {
    /// How it stands to its reference.
    pub agreement: Agreement,
    /// The last step of the window that was compared.
    pub as_of_step: Option<Step>,
    /// In words, what keeps it from being normal.
    pub reason: Option<String>,
}
