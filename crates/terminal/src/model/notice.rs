//! What became of what was typed, on one line.

use names::printable;
use wire::Obeyed;
use wording::{Tone, done};

use super::exchange::{Given, Outcome};

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
    pub(crate) fn ended(given: &Given, outcome: &Outcome) -> Self {
        let (component, module) = (&given.subject.component, &given.subject.component.module);
        let kind = given.kind.as_str();
        let (tone, text) = match outcome {
            Outcome::Obeyed(Obeyed { state, sequence, durable: true, .. }) => {
                (Tone::Calm, format!("{}: now {state}, transition {sequence}", done(given.kind)))
            }
            Outcome::Obeyed(_) => (
                Tone::Alarm,
                format!(
                    "{}, but not saved: see the disk of {module}, then repeat it",
                    done(given.kind)
                ),
            ),
            Outcome::Refused(reason) => {
                (Tone::Alarm, format!("{kind} refused: {}", printable(reason)))
            }
            Outcome::Unanswered(reason) => (
                Tone::Alarm,
                format!("{kind}: {}; it may or may not have been carried out", printable(reason)),
            ),
            Outcome::NotSent(reason) => {
                (Tone::Alarm, format!("{kind} not sent: {}", printable(reason)))
            }
        };
        Self { tone, text: format!("{component} {text}") }
    }
}
