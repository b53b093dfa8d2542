//! Peers' questions into the diagnoser's queue.

use tokio::sync::mpsc;
use wire::{StateQuestion, Topic};
use zenoh::Session;
use zenoh::query::{Query, Queryable};

use super::outbox::{Outbox, Outgoing};
use crate::convert::Speaker;

/// A question and where its answer goes.
#[derive(Debug)]
pub(crate) struct Inquiry {
    pub(crate) question: StateQuestion,
    pub(crate) query: Query,
}

/// Answers `{module}/state`.
pub(crate) async fn declare(
    session: &Session,
    speaker: &Speaker,
    queue: mpsc::Sender<Inquiry>,
    outbox: Outbox,
) -> zenoh::Result<Queryable<()>> {
    session
        .declare_queryable(speaker.key(Topic::State))
        .complete(true)
        .callback(move |query| take(query, &queue, &outbox))
        .await
}

fn take(query: Query, queue: &mpsc::Sender<Inquiry>, outbox: &Outbox) {
    match StateQuestion::from_parameters(query.parameters().as_str()) {
        Ok(question) => {
            if let Err(error) = queue.try_send(Inquiry { question, query }) {
                let Inquiry { query, .. } = error.into_inner();
                outbox.turn_away(query);
            }
        }
        Err(error) => outbox.routine(Outgoing::Refusal { query, reason: error.to_string() }),
    }
}
