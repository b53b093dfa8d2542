//! Queries to this module. Each question received is counted, and answered, refused for a
//! reason, or turned away because too many are waiting.
//!
//! | file | key |
//! |---|---|
//! | this | `{module}/state`: peers' questions, into the diagnoser's queue |
//! | `present` | `{module}/fault/**`, `{module}/identification/**`, `{module}/phase`: what is known at present |
//! | `history` | `{module}/history`: pages of the journal, read by a thread of its own |
//! | `provenance` | `{module}/input`, `{module}/configuration`: what verdicts come from, given by a thread of its own |
//! | `orders` | `{module}/command/…`: operators' orders, into the diagnoser's queue |

mod history;
mod orders;
mod present;
mod provenance;

pub(crate) use orders::OrderInquiry;
pub(crate) use provenance::{ProvenanceAnswers, Snapshot};

use present::PresentReplies;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, TrySendError};

use shell::supervision::{Crew, Ended, Pulse};
use tokio::sync::mpsc;
use vocabulary::{InquiryCounters, QuestionError, StateQuestion, Topic};
use zenoh::Session;
use zenoh::query::{Query, Queryable};

use super::publish::{ModuleOutbox, RoutineMessage};
use super::store::ModuleStore;
use crate::counters::SharedCounters;
use crate::messages::{TOO_MANY_QUESTIONS, refuse};
use diagnosis::messages::Speaker;

/// Questions and orders that may wait for the diagnoser.
const QUEUE: usize = 1024;

/// The outcomes of queries, which every queryable counts.
pub(crate) type SharedInquiryCounters = Arc<SharedCounters<InquiryCounters>>;

/// A question of a peer and where its answer goes.
#[derive(Debug)]
pub(crate) struct StateInquiry {
    pub(crate) question: StateQuestion,
    pub(crate) query: Query,
}

/// What the diagnoser takes from.
#[derive(Debug)]
pub(crate) struct InquiryQueues {
    pub(crate) state: mpsc::Receiver<StateInquiry>,
    pub(crate) orders: mpsc::Receiver<OrderInquiry>,
    /// Where its whole state is to go.
    pub(crate) snapshots: mpsc::Receiver<SyncSender<Snapshot>>,
}

/// The queryables; questions come in as long as they live.
#[derive(Debug)]
pub(crate) struct Queryables(Vec<Queryable<()>>);

impl Queryables {
    /// Declares all of them; with what signals that the thread has ended which replies from the store.
    pub(crate) async fn declare(
        session: &Session,
        speaker: &Speaker,
        (outbox, store, pulse): (&ModuleOutbox, ModuleStore, Arc<Pulse>),
        (directory, provenance, crew): (Option<PathBuf>, ProvenanceAnswers, &Crew),
        counters: &SharedInquiryCounters,
    ) -> zenoh::Result<(Self, InquiryQueues, Ended)> {
        let (state_in, state) = mpsc::channel(QUEUE);
        let (orders_in, orders) = mpsc::channel(QUEUE);
        let mut queryables =
            vec![declare_state(session, speaker, state_in, outbox.clone(), counters).await?];
        let replies = PresentReplies::new(speaker.clone(), store, pulse, Arc::clone(counters));
        let declaring = replies.declare(session, outbox, crew);
        let (present, ended) = declaring.await?;
        queryables.extend(present);
        queryables.push(history::declare(session, speaker, (directory, crew), counters).await?);
        let (snapshots_in, snapshots) = mpsc::channel(1);
        let provenance = (provenance, snapshots_in, crew);
        let declaring = provenance::declare(session, speaker, provenance, counters);
        queryables.extend(declaring.await?);
        queryables.extend(orders::declare(session, speaker, &orders_in, outbox, counters).await?);
        Ok((Self(queryables), InquiryQueues { state, orders, snapshots }, ended))
    }

    /// No more questions.
    pub(crate) async fn undeclare(self) -> zenoh::Result<()> {
        for queryable in self.0 {
            queryable.undeclare().await?;
        }
        Ok(())
    }
}

/// Queues a question for the thread that replies to it. An invalid question, or one for which the queue has no room, is
/// refused.
fn hand_over<Q>(
    question: Result<Q, QuestionError>,
    query: Query,
    queue: &SyncSender<(Q, Query)>,
    counters: &SharedCounters<InquiryCounters>,
) {
    counters.count(|counters| counters.received += 1);
    match question {
        Ok(question) => {
            if let Err(error) = queue.try_send((question, query)) {
                counters.count(|counters| counters.turned_away += 1);
                let (TrySendError::Full((_, query)) | TrySendError::Disconnected((_, query))) =
                    error;
                refuse(&query, TOO_MANY_QUESTIONS.to_owned());
            }
        }
        Err(error) => {
            counters.count(|counters| counters.malformed += 1);
            refuse(&query, error.to_string());
        }
    }
}

async fn declare_state(
    session: &Session,
    speaker: &Speaker,
    queue: mpsc::Sender<StateInquiry>,
    outbox: ModuleOutbox,
    counters: &SharedInquiryCounters,
) -> zenoh::Result<Queryable<()>> {
    let counters = Arc::clone(counters);
    session
        .declare_queryable(speaker.key(Topic::State))
        .complete(true)
        .callback(move |query| take_state(query, &queue, &outbox, &counters))
        .await
}

fn take_state(
    query: Query,
    queue: &mpsc::Sender<StateInquiry>,
    outbox: &ModuleOutbox,
    counters: &SharedCounters<InquiryCounters>,
) {
    counters.count(|counters| counters.received += 1);
    match StateQuestion::from_parameters(query.parameters().as_str()) {
        Ok(question) => {
            if let Err(error) = queue.try_send(StateInquiry { question, query }) {
                counters.count(|counters| counters.turned_away += 1);
                let StateInquiry { query, .. } = error.into_inner();
                let reason = TOO_MANY_QUESTIONS.to_owned();
                outbox.routine(RoutineMessage::Refusal { query, reason });
            }
        }
        Err(error) => {
            counters.count(|counters| counters.malformed += 1);
            outbox.routine(RoutineMessage::Refusal { query, reason: error.to_string() });
        }
    }
}
