//! What became of an order, in words.

use observer::OrderError;
use wire::Obeyed;
use wording::printable;

use super::given::Given;

/// For the person, and for the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Outcome {
    /// In words.
    pub(super) words: String,
    was_obeyed: bool,
}

impl Outcome {
    /// Nothing was sent, for this reason.
    pub(super) fn not_sent(wrong: &str) -> Self {
        Self { words: format!("{}; no order was sent", printable(wrong)), was_obeyed: false }
    }

    /// What a diagnoser answered, or that it did not.
    pub(super) fn of(given: &Given, result: Result<Obeyed, OrderError>) -> Self {
        let subject = given.subject();
        let was_obeyed = result.is_ok();
        let words = match result {
            Ok(Obeyed { durable: false, .. }) => wording::not_saved(given.module.as_str()),
            Ok(Obeyed { state, sequence, .. }) => {
                let state = printable(&state.to_string());
                format!("{}: now {state}, transition {sequence}", wording::done(given.kind))
            }
            Err(OrderError::Refused(reason)) => format!("refused: {}", printable(&reason)),
            Err(OrderError::Untaken) => wording::perhaps(wording::UNTAKEN),
            Err(error) => wording::perhaps(&printable(&error.to_string())),
        };
        Self { words: format!("{subject}: {words}"), was_obeyed }
    }

    /// Notes it in the log.
    pub(super) fn log(&self, person: &str) {
        let (person, words) = (printable(person), &self.words);
        if self.was_obeyed {
            tracing::info!("an order by {person}: {words}");
        } else {
            tracing::warn!("an order by {person}: {words}");
        }
    }
}
