//! The state of a component.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a module holds of one of its components: the word of its [`crate::Verdict`].
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum FaultState {
    /// No change, or an explained change has ended.
    Normal,
    /// A change, not yet judged.
    Tentative,
    /// A change that cannot be judged because peers do not answer.
    Unconfirmed,
    /// A change that another component's fault explains.
    Explained,
    /// A fault of this component; stays until reset.
    Latched,
    /// A fault of this component that a person has acknowledged; stays until reset.
    Acknowledged,
    /// Nothing is known of it at present, since its module does not watch it. Only in answer to a question:
    /// no transition leads here, as the verdict is what it was.
    Unknown,
}

impl FaultState {
    /// A fault of the component itself: latched, acknowledged or not.
    #[must_use]
    pub fn is_fault(self) -> bool {
        matches!(self, FaultState::Latched | FaultState::Acknowledged)
    }

    /// The name in messages.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            FaultState::Normal => "normal",
            FaultState::Tentative => "tentative",
            FaultState::Unconfirmed => "unconfirmed",
            FaultState::Explained => "explained",
            FaultState::Latched => "latched",
            FaultState::Acknowledged => "acknowledged",
            FaultState::Unknown => "unknown",
        }
    }
}

impl fmt::Display for FaultState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}
