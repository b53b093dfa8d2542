//! What became of what was typed, on one line.

use observer::OrderOutcome;
use vocabulary::words::Tone;

use super::exchange::Given;

/// A line, and how much attention it asks for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Notice {
    pub(crate) tone: Tone,
    pub(crate) text: String,
}

impl Notice {
    pub(crate) fn refusal(reason: impl Into<String>) -> Self {
        Self { tone: Tone::Doubt, text: reason.into() }
    }

    /// The order is on its way.
    pub(crate) fn sent(given: &Given) -> Self {
        let (kind, component) = (given.kind.as_str(), &given.subject.component);
        Self { tone: Tone::Explained, text: format!("sent: {kind} {component}; no answer yet") }
    }

    /// How it ended.
    pub(crate) fn ended(given: &Given, outcome: &OrderOutcome) -> Self {
        let text = outcome.words(given.kind, &given.subject.component.to_string());
        Self { tone: outcome.tone(), text }
    }
}
