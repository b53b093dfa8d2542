//! Asks peers what they know, and tells apart how that can end.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use diagnosis::{Event, PeerFailure, Question};
use tokio::sync::{Semaphore, mpsc};
use truss::ids::ModuleName;
use wire::{Refused, StateAnswer, Topic};
use zenoh::Session;
use zenoh::handlers::FifoChannelHandler;
use zenoh::query::{ConsolidationMode, Querier, Reply};

use crate::config::DiagnoserConfig;
use crate::convert::{Speaker, from_answer, to_question};

/// Questions under way at a time, per peer.
const UNDER_WAY_PER_PEER: usize = 4;
/// The network's own time limit comes first; this one is for a network that fails to keep it.
const GRACE: Duration = Duration::from_millis(200);

/// One querier for each peer.
#[derive(Debug)]
pub(crate) struct PeerQueries {
    queriers: BTreeMap<ModuleName, Arc<Querier<'static>>>,
    timeout: Duration,
    under_way: Arc<Semaphore>,
    answers: mpsc::Sender<Event>,
}

impl PeerQueries {
    pub(crate) async fn declare(
        session: &Session,
        speaker: &Speaker,
        config: &DiagnoserConfig,
        answers: mpsc::Sender<Event>,
    ) -> zenoh::Result<Self> {
        let timeout = config.queries.timeout();
        let mut queriers = BTreeMap::new();
        for peer in config.peers() {
            let key = wire::Key::of_module(&speaker.structure, peer, Topic::State).to_string();
            let querier = session
                .declare_querier(key)
                .consolidation(ConsolidationMode::None)
                .timeout(timeout)
                .await?;
            queriers.insert(peer.clone(), Arc::new(querier));
        }
        let under_way = Arc::new(Semaphore::new(UNDER_WAY_PER_PEER * queriers.len().max(1)));
        Ok(Self { queriers, timeout, under_way, answers })
    }

    /// Asks in a task of its own; the outcome comes back as an event.
    pub(crate) fn ask(&self, peer: ModuleName, question: Question) {
        let querier = self.queriers.get(&peer).cloned();
        let permit = Arc::clone(&self.under_way).try_acquire_owned();
        let limit = self.timeout + GRACE;
        let answers = self.answers.clone();
        tokio::spawn(async move {
            let outcome = match (querier, &permit) {
                (Some(querier), Ok(_)) => ask(&querier, question, limit).await,
                // The diagnoser asks only peers it was told of, and one question at a time.
                _ => Err(PeerFailure::TimedOut),
            };
            let event = match outcome {
                Ok(answer) => Event::Answered { peer, answer: from_answer(answer) },
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

async fn ask(
    querier: &Querier<'static>,
    question: Question,
    limit: Duration,
) -> Result<StateAnswer, PeerFailure> {
    let parameters = to_question(question).to_parameters();
    let asked = async {
        match querier.get().parameters(parameters).await {
            Ok(replies) => first_word(replies).await,
            Err(error) => {
                tracing::debug!("question not sent: {error}");
                Err(PeerFailure::Absent)
            }
        }
    };
    tokio::time::timeout(limit, asked).await.unwrap_or(Err(PeerFailure::TimedOut))
}

/// The first answer; failing that, how it failed.
async fn first_word(replies: FifoChannelHandler<Reply>) -> Result<StateAnswer, PeerFailure> {
    let mut failure = PeerFailure::Absent;
    while let Ok(reply) = replies.recv_async().await {
        match reply.result() {
            Ok(sample) => {
                let decoded = wire::decode(&sample.payload().to_bytes());
                return decoded.map_err(|error| PeerFailure::Malformed(error.to_string()));
            }
            Err(error) => failure = failed(&error.payload().to_bytes()),
        }
    }
    Err(failure)
}

/// An error reply is the peer's refusal, or the network's word that time is up.
fn failed(bytes: &[u8]) -> PeerFailure {
    match wire::decode::<Refused>(bytes) {
        Ok(refused) => PeerFailure::Refused(refused.reason),
        Err(_) if bytes == b"Timeout" => PeerFailure::TimedOut,
        Err(_) => PeerFailure::Refused(String::from_utf8_lossy(bytes).chars().take(200).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_and_the_networks_timeout_are_told_apart() {
        let refused = wire::encode(&Refused { reason: "no sample yet".into() }).unwrap();
        assert_eq!(failed(&refused), PeerFailure::Refused("no sample yet".into()));
        assert_eq!(failed(b"Timeout"), PeerFailure::TimedOut);
        assert_eq!(failed(b"whatever"), PeerFailure::Refused("whatever".into()));
    }
}
