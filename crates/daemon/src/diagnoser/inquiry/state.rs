//! Peers' questions into the diagnoser's queue.

use std::sync::Arc;

use tokio::sync::mpsc;
use vocabulary::{StateQuestion, Topic};
use zenoh::Session;
use zenoh::query::{Query, Queryable};

use super::InquiryTally;
use crate::diagnoser::outgoing::{Outbox, Routine};
use crate::messages::TOO_MANY_QUESTIONS;
use diagnosis::messages::Speaker;

/// A question and where its answer goes.
#[derive(Debug)]
pub(crate) struct StateInquiry {
    pub(crate) question: StateQuestion,
    pub(crate) query: Query,
}

pub(super) async fn declare(
    session: &Session,
    speaker: &Speaker,
    queue: mpsc::Sender<StateInquiry>,
    outbox: Outbox,
    counters: &Arc<InquiryTally>,
) -> zenoh::Result<Queryable<()>> {
    let counters = Arc::clone(counters);
    session
        .declare_queryable(speaker.key(Topic::State))
        .complete(true)
        .callback(move |query| take(query, &queue, &outbox, &counters))
        .await
}

fn take(
    query: Query,
    queue: &mpsc::Sender<StateInquiry>,
    outbox: &Outbox,
    counters: &InquiryTally,
) {
    counters.received();
    match StateQuestion::from_parameters(query.parameters().as_str()) {
        Ok(question) => {
            if let Err(error) = queue.try_send(StateInquiry { question, query }) {
                counters.turned_away();
                let StateInquiry { query, .. } = error.into_inner();
                let reason = TOO_MANY_QUESTIONS.to_owned();
                outbox.routine(Routine::Refusal { query, reason });
            }
        }
        Err(error) => {
            counters.malformed();
            outbox.routine(Routine::Refusal { query, reason: error.to_string() });
        }
    }
}
