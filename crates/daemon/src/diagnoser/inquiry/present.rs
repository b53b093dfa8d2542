//! Queries for what is known at present: the states of components, the identifications of their faults, and the phase.

use std::sync::Arc;

use tokio::sync::Semaphore;
use wire::keys::Watched;
use zenoh::Session;
use zenoh::query::{Query, Queryable};

use super::InquiryTally;
use crate::diagnoser::outgoing::{Asked, Outbox, Routine, Wanted};
use crate::messages::TOO_MANY_QUESTIONS;
use translation::Speaker;

/// Questions of each kind that may wait.
const MAX_WAITING: usize = 64;

fn expression(wanted: Wanted, speaker: &Speaker) -> String {
    let watched = Watched { structure: Some(&speaker.structure), module: Some(&speaker.module) };
    match wanted {
        Wanted::States => watched.faults(),
        Wanted::Identifications => watched.identifications(),
        Wanted::Phase => watched.phases(),
    }
}

pub(super) async fn declare(
    session: &Session,
    speaker: &Speaker,
    wanted: Wanted,
    outbox: Outbox,
    counters: &Arc<InquiryTally>,
) -> zenoh::Result<Queryable<()>> {
    let counters = Arc::clone(counters);
    let places = Arc::new(Semaphore::new(MAX_WAITING));
    session
        .declare_queryable(expression(wanted, speaker))
        .callback(move |query: Query| {
            counters.received();
            let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
                counters.turned_away();
                let reason = TOO_MANY_QUESTIONS.to_owned();
                outbox.routine(Routine::Refusal { query, reason });
                return;
            };
            if outbox.question(Asked { wanted, query, place }) {
                counters.answered();
            } else {
                counters.turned_away();
            }
        })
        .await
}
