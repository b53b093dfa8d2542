//! The outcome of the latest input, on one line.

use observer::{OrderOutcome, OrderRequest};
use vocabulary::words::Tone;

/// A line, and its severity.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Notice {
    pub(crate) tone: Tone,
    pub(crate) text: String,
}

impl Notice {
    pub(crate) fn refusal(reason: impl Into<String>) -> Self {
        Self { tone: Tone::Doubt, text: reason.into() }
    }

    /// The order was sent.
    pub(crate) fn sent(request: &OrderRequest) -> Self {
        let (kind, subject) = (request.kind.as_str(), request.subject());
        Self { tone: Tone::Explained, text: format!("sent: {kind} {subject}; no answer yet") }
    }

    /// The outcome of the order.
    pub(crate) fn ended(request: &OrderRequest, outcome: &OrderOutcome) -> Self {
        let text = outcome.words(request.kind, &request.subject());
        Self { tone: outcome.tone(), text }
    }
}
