//! Queries peers, and distinguishes the outcomes.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use diagnosis::{Event, PeerFailure};
use parking_lot::Mutex;
use process::PeerTimeouts;
use tokio::sync::{Semaphore, mpsc};
use vocabulary::{ModuleName, Refused, StateAnswer, StateQuestion, Topic};
use zenoh::Session;
use zenoh::handlers::FifoChannelHandler;
use zenoh::query::{ConsolidationMode, Querier, QueryTarget, Reply};

use super::PeerTable;
use super::presence::Presence;
use crate::config::DiagnoserConfig;
use diagnosis::messages::Speaker;

/// Questions under way at a time, per peer. Seven are put within the longest timeout, if it is 1.2 s: one about open
/// cases, two about long windows, four about short ones.
const UNDER_WAY_PER_PEER: usize = 8;
/// The network's own time limit comes first; this one is for a network that fails to keep it.
const GRACE: Duration = Duration::from_millis(200);

/// For each peer a querier with each timeout: a querier's timeout is fixed when it is declared.
#[derive(Debug)]
pub(crate) struct PeerQueries {
    queriers: BTreeMap<(ModuleName, Duration), Arc<Querier<'static>>>,
    presence: Presence,
    timeouts: Arc<Mutex<PeerTimeouts>>,
    under_way: Arc<Semaphore>,
    table: PeerTable,
    answers: mpsc::Sender<Event>,
}

impl PeerQueries {
    pub(crate) async fn declare(
        session: &Session,
        speaker: &Speaker,
        config: &DiagnoserConfig,
        table: PeerTable,
        answers: mpsc::Sender<Event>,
    ) -> zenoh::Result<Self> {
        let timeouts = PeerTimeouts::new(config.queries.timeout());
        let peers = config.peers();
        let mut queriers = BTreeMap::new();
        for peer in peers {
            for timeout in timeouts.all() {
                let querier = declare_querier(session, speaker, peer, timeout).await?;
                queriers.insert((peer.clone(), timeout), Arc::new(querier));
            }
        }
        let under_way = Arc::new(Semaphore::new(UNDER_WAY_PER_PEER * peers.len().max(1)));
        let presence = Presence::new(session, speaker, table.clone());
        let timeouts = Arc::new(Mutex::new(timeouts));
        Ok(Self { queriers, presence, timeouts, under_way, table, answers })
    }

    /// Asks in a task of its own; the outcome comes back as an event.
    pub(crate) fn ask(&self, peer: ModuleName, question: StateQuestion) {
        let timeout = self.timeouts.lock().of_next(&peer);
        let querier = self.queriers.get(&(peer.clone(), timeout)).cloned();
        let permit = Arc::clone(&self.under_way).try_acquire_owned();
        let answers = self.answers.clone();
        let (table, presence) = (self.table.clone(), self.presence.clone());
        let timeouts = Arc::clone(&self.timeouts);
        tokio::spawn(async move {
            let outcome = match (querier, &permit) {
                (Some(querier), Ok(_)) => {
                    let outcome = ask(&querier, question, timeout + GRACE).await;
                    timeouts.lock().note(&peer, timeout, outcome.as_ref().err());
                    match outcome {
                        Ok(answer) => credible(answer, (&peer, question), &presence).await,
                        failed => failed,
                    }
                }
                // The diagnoser queries configured peers only, a few queries at a time.
                _ => Err(PeerFailure::TimedOut),
            };
            table.note_outcome(&peer, outcome.as_ref().err());
            let event = match outcome {
                Ok(answer) => Event::Answered(answer),
                Err(failure) => {
                    tracing::debug!(%peer, ?question, "question not answered: {failure}");
                    Event::Unanswered { peer, question, failure }
                }
            };
            // Fails only when the diagnoser is ending.
            let _ = answers.send(event).await;
        });
    }
}

async fn declare_querier(
    session: &Session,
    speaker: &Speaker,
    peer: &ModuleName,
    timeout: Duration,
) -> zenoh::Result<Querier<'static>> {
    let key = vocabulary::Key::of_module(&speaker.structure, peer, Topic::State).to_string();
    session
        .declare_querier(key)
        // All answers in the peer's name are collected, to check whether they agree.
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .timeout(timeout)
        .await
}

async fn ask(
    querier: &Querier<'static>,
    question: StateQuestion,
    limit: Duration,
) -> Result<StateAnswer, PeerFailure> {
    let parameters = question.to_parameters();
    let asked = async {
        match querier.get().parameters(parameters).await {
            Ok(replies) => common_word(replies).await,
            Err(error) => {
                tracing::debug!("question not sent: {error}");
                Err(PeerFailure::Absent)
            }
        }
    };
    tokio::time::timeout(limit, asked).await.unwrap_or(Err(PeerFailure::TimedOut))
}

/// An answer is accepted only under the peer's own name, to the very question, and while its token says that it is
/// there: otherwise another process has answered in its place.
async fn credible(
    answer: StateAnswer,
    (peer, question): (&ModuleName, StateQuestion),
    presence: &Presence,
) -> Result<StateAnswer, PeerFailure> {
    if answer.module != *peer {
        return Err(PeerFailure::Malformed(format!("an answer of module `{}`", answer.module)));
    }
    if answer.question != question {
        return Err(PeerFailure::Malformed("another question than the one asked".to_owned()));
    }
    if !presence.is_there(peer).await {
        return Err(PeerFailure::Malformed(
            "answer from a process without a liveliness token".to_owned(),
        ));
    }
    Ok(answer)
}

/// What all who answer agree on; failing that, how it failed. A single refusal outweighs answers: if two
/// answer in a peer's name, one of them is not the peer. One that gives no answer in time does not
/// count, because the network may remember a process that is long gone.
async fn common_word(replies: FifoChannelHandler<Reply>) -> Result<StateAnswer, PeerFailure> {
    let mut common: Option<StateAnswer> = None;
    while let Ok(reply) = replies.recv_async().await {
        let answer: StateAnswer = match reply.result() {
            Ok(sample) => vocabulary::decode(&sample.payload().to_bytes())
                .map_err(|error| PeerFailure::Malformed(error.to_string()))?,
            Err(error) => match failed(&error.payload().to_bytes()) {
                PeerFailure::TimedOut if common.is_some() => break,
                failure => return Err(failure),
            },
        };
        match &common {
            Some(other) if *other != answer => {
                let reason = "two answers that contradict each other".to_owned();
                return Err(PeerFailure::Malformed(reason));
            }
            _ => common = Some(answer),
        }
    }
    common.ok_or(PeerFailure::Absent)
}

/// An error reply is the peer's refusal, or the network's timeout.
fn failed(bytes: &[u8]) -> PeerFailure {
    match vocabulary::decode::<Refused>(bytes) {
        Ok(refused) => PeerFailure::Refused(refused.reason),
        Err(_) if bytes == b"Timeout" => PeerFailure::TimedOut,
        Err(_) => PeerFailure::Refused(String::from_utf8_lossy(bytes).chars().take(200).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_and_the_networks_timeout_are_distinguished() {
        let refused = vocabulary::encode(&Refused { reason: "no sample yet".into() }).unwrap();
        assert_eq!(failed(&refused), PeerFailure::Refused("no sample yet".into()));
        assert_eq!(failed(b"Timeout"), PeerFailure::TimedOut);
        assert_eq!(failed(b"whatever"), PeerFailure::Refused("whatever".into()));
    }
}
