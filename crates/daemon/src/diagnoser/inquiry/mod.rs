//! Queries to this module. Each question received is counted, and answered, refused for a
//! reason, or turned away because too many are waiting.
//!
//! | file | key |
//! |---|---|
//! | `state` | `{module}/state`: peers' questions, into the diagnoser's queue |
//! | `present` | `{module}/fault/**`, `{module}/identification/**`, `{module}/phase`: what is known at present |
//! | `history` | `{module}/history`: pages of the journal, read by a thread of its own |
//! | `provenance` | `{module}/input`, `{module}/configuration`: what verdicts come from, given by a thread of its own |
//! | `orders` | `{module}/command/…`: operators' orders, into the diagnoser's queue |

mod history;
mod orders;
mod present;
mod provenance;
mod state;
mod tally;

pub(crate) use orders::OrderInquiry;
pub(crate) use provenance::Provenance;
pub(crate) use state::StateInquiry;
pub(crate) use tally::InquiryTally;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, TrySendError};

use shell::supervision::Crew;
use tokio::sync::mpsc;
use vocabulary::QuestionError;
use zenoh::Session;
use zenoh::query::{Query, Queryable};

use super::outgoing::{Outbox, Wanted};
use crate::messages::{TOO_MANY_QUESTIONS, refuse};
use diagnosis::messages::Speaker;

/// Questions and orders that may wait for the diagnoser.
const QUEUE: usize = 1024;

/// What the diagnoser takes from.
#[derive(Debug)]
pub(crate) struct InquiryQueues {
    pub(crate) state: mpsc::Receiver<StateInquiry>,
    pub(crate) orders: mpsc::Receiver<OrderInquiry>,
}

/// The queryables; questions come in as long as they live.
#[derive(Debug)]
pub(crate) struct Queryables(Vec<Queryable<()>>);

impl Queryables {
    /// Declares all of them.
    pub(crate) async fn declare(
        session: &Session,
        speaker: &Speaker,
        outbox: &Outbox,
        (directory, provenance, crew): (Option<PathBuf>, Provenance, &Crew),
        counters: &Arc<InquiryTally>,
    ) -> zenoh::Result<(Self, InquiryQueues)> {
        let (state_in, state) = mpsc::channel(QUEUE);
        let (orders_in, orders) = mpsc::channel(QUEUE);
        let mut queryables =
            vec![state::declare(session, speaker, state_in, outbox.clone(), counters).await?];
        for wanted in [Wanted::States, Wanted::Identifications, Wanted::Phase] {
            let outbox = outbox.clone();
            queryables.push(present::declare(session, speaker, wanted, outbox, counters).await?);
        }
        queryables.push(history::declare(session, speaker, (directory, crew), counters).await?);
        let declaring = provenance::declare(session, speaker, (provenance, crew), counters);
        queryables.extend(declaring.await?);
        queryables.extend(orders::declare(session, speaker, &orders_in, outbox, counters).await?);
        Ok((Self(queryables), InquiryQueues { state, orders }))
    }

    /// No more questions.
    pub(crate) async fn undeclare(self) -> zenoh::Result<()> {
        for queryable in self.0 {
            queryable.undeclare().await?;
        }
        Ok(())
    }
}

/// Puts a question into the queue of the thread that replies to it; what finds no room there or is none is refused.
fn hand_over<Q>(
    question: Result<Q, QuestionError>,
    query: Query,
    queue: &SyncSender<(Q, Query)>,
    counters: &InquiryTally,
) {
    counters.received();
    match question {
        Ok(question) => {
            if let Err(error) = queue.try_send((question, query)) {
                counters.turned_away();
                let (TrySendError::Full((_, query)) | TrySendError::Disconnected((_, query))) =
                    error;
                refuse(&query, TOO_MANY_QUESTIONS.to_owned());
            }
        }
        Err(error) => {
            counters.malformed();
            refuse(&query, error.to_string());
        }
    }
}
