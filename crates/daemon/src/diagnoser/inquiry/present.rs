//! Queries for what is known at present: the states of components, and the identifications of their faults.

use std::sync::Arc;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use wire::keys::Watched;
use zenoh::Session;
use zenoh::query::{Query, Queryable};

use super::InquiryTally;
use crate::convert::Speaker;
use crate::diagnoser::outgoing::{Outbox, Outgoing, Routine};
use crate::messages::TOO_MANY_QUESTIONS;

/// Questions of each kind that may wait. They share the way out with events, which they must not crowd out.
const MAX_WAITING: usize = 64;

/// What is asked for.
#[derive(Debug, Clone, Copy)]
pub(super) enum Wanted {
    /// The state of each component.
    States,
    /// Of each faulty component, what its fault is.
    Identifications,
}

impl Wanted {
    fn expression(self, speaker: &Speaker) -> String {
        let watched =
            Watched { structure: Some(&speaker.structure), module: Some(&speaker.module) };
        match self {
            Wanted::States => watched.faults(),
            Wanted::Identifications => watched.identifications(),
        }
    }

    fn question(self, query: Query, place: OwnedSemaphorePermit) -> Outgoing {
        match self {
            Wanted::States => Outgoing::States { query, place },
            Wanted::Identifications => Outgoing::Identifications { query, place },
        }
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
        .declare_queryable(wanted.expression(speaker))
        .callback(move |query: Query| {
            counters.received();
            let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
                counters.turned_away();
                let reason = TOO_MANY_QUESTIONS.to_owned();
                outbox.routine(Routine::Refusal { query, reason });
                return;
            };
            if outbox.event(wanted.question(query, place)) {
                counters.answered();
            } else {
                counters.turned_away();
            }
        })
        .await
}
