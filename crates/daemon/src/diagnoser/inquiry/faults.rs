//! Queries for the present states.

use std::sync::Arc;

use tokio::sync::Semaphore;
use zenoh::Session;
use zenoh::query::{Query, Queryable};

use super::InquiryTally;
use crate::convert::Speaker;
use crate::diagnoser::outgoing::{Outbox, Outgoing, Routine};
use crate::messages::TOO_MANY_QUESTIONS;

/// Questions that may wait. They share the way out with events, which they must not crowd out.
const MAX_WAITING: usize = 64;

pub(super) async fn declare(
    session: &Session,
    speaker: &Speaker,
    outbox: Outbox,
    counters: &Arc<InquiryTally>,
) -> zenoh::Result<Queryable<()>> {
    let counters = Arc::clone(counters);
    let places = Arc::new(Semaphore::new(MAX_WAITING));
    let watched =
        wire::keys::Watched { structure: Some(&speaker.structure), module: Some(&speaker.module) };
    session
        .declare_queryable(watched.faults())
        .callback(move |query: Query| {
            counters.received();
            let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
                counters.turned_away();
                let reason = TOO_MANY_QUESTIONS.to_owned();
                outbox.routine(Routine::Refusal { query, reason });
                return;
            };
            if outbox.event(Outgoing::States { query, place }) {
                counters.answered();
            } else {
                counters.turned_away();
            }
        })
        .await
}
