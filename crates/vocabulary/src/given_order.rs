//! The order that led to a transition.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::tagged_by_word;
use crate::shelving::Span;

/// What was ordered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "order", rename_all = "snake_case")]
pub enum GivenOrderKind {
    /// An operator has seen the fault.
    Acknowledge,
    /// The component was replaced, and what it measures now is right: back to normal, and its reference is shifted.
    ReTare,
    /// The component is repaired: back to normal.
    Reset {
        /// Even if it is not acknowledged, or the evidence is still there.
        force: bool,
    },
    /// Its alarm is shelved for a time. No verdict depends on it.
    Shelve(Span),
    /// Its alarm counts again.
    Unshelve,
    /// Its alarm is suppressed while the module is maintained.
    Suppress(Span),
    /// Its alarm counts again.
    Unsuppress,
    /// An operator knows it to be faulty.
    Declare,
    /// It is a cylinder, and is shut off.
    ShutOff {
        /// Since when \[ns since 1970\].
        since_unix_ns: u64,
    },
    /// The cylinder is put back.
    PutBack,
    /// Its shelving or suppression has expired without an order.
    Lapse {
        /// When that was noticed, by the diagnoser's clock \[ns since 1970\].
        now_unix_ns: u64,
    },
}

impl GivenOrderKind {
    /// Whether it is about the verdict, not about the alarm alone.
    #[must_use]
    pub fn is_about_verdict(self) -> bool {
        matches!(
            self,
            GivenOrderKind::Acknowledge
                | GivenOrderKind::ReTare
                | GivenOrderKind::Reset { .. }
                | GivenOrderKind::Declare
        )
    }
}

/// The order that caused a transition: what, by whom and why.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct GivenOrder {
    /// What was ordered.
    #[serde(flatten, deserialize_with = "tagged_by_word")]
    pub kind: GivenOrderKind,
    /// By whom.
    pub by: String,
    /// In whose name, if `by` is a program that a person uses, such as the web page.
    pub on_behalf_of: Option<String>,
    /// Why.
    pub note: Option<String>,
}

impl GivenOrder {
    /// An order that no person gave.
    #[must_use]
    pub fn by_itself(kind: GivenOrderKind, note: Option<String>) -> Self {
        Self { kind, by: "trusswatch".to_owned(), on_behalf_of: None, note }
    }
}
