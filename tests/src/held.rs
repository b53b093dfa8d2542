//! What a module holds of a component, as far as it can be compared: not when it was found.

use std::fmt;

use diagnosis::Verdict;
use vocabulary::{ComponentPath, FaultState, FaultTransition};

/// What is held of a component.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Held {
    /// Nothing is the matter.
    Normal,
    /// A change, not yet judged.
    Tentative,
    /// A change that cannot be judged.
    Unconfirmed,
    /// A change that this component explains.
    Explained(Option<ComponentPath>),
    /// A fault of the component itself, acknowledged or not.
    Latched,
}

impl Held {
    /// From a verdict in one process.
    #[must_use]
    pub fn of_verdict(verdict: &Verdict) -> Self {
        match verdict {
            Verdict::Normal | Verdict::Unknown => Held::Normal,
            Verdict::Tentative => Held::Tentative,
            Verdict::Unconfirmed { .. } => Held::Unconfirmed,
            Verdict::Explained { by, .. } => Held::Explained(Some(by.clone())),
            Verdict::Latched | Verdict::Acknowledged => Held::Latched,
        }
    }

    /// From a message.
    #[must_use]
    pub fn of_message(message: &FaultTransition) -> Self {
        match message.state() {
            FaultState::Normal | FaultState::Unknown => Held::Normal,
            FaultState::Tentative => Held::Tentative,
            FaultState::Unconfirmed => Held::Unconfirmed,
            FaultState::Explained => Held::Explained(message.verdict.explained_by().cloned()),
            FaultState::Latched | FaultState::Acknowledged => Held::Latched,
        }
    }
}

impl fmt::Display for Held {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Held::Normal => f.write_str("normal"),
            Held::Tentative => f.write_str("tentative"),
            Held::Unconfirmed => f.write_str("unconfirmed"),
            Held::Explained(Some(by)) => write!(f, "explained by {by}"),
            Held::Explained(None) => f.write_str("explained by an unnamed root"),
            Held::Latched => f.write_str("latched"),
        }
    }
}
