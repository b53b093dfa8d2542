//! Answers, divergences, corrected readings, capability, status and progress, in order, on a thread of its own: none of them waits for
//! the disk, and none is worth waiting for the network.

use std::sync::Arc;

use shell::supervision::Lane;
use tokio::sync::mpsc;
use vocabulary::{InquiryCounters, Topic};
use zenoh::bytes::Encoding;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;
use zenoh::query::Query;
use zenoh::{Session, Wait};

use super::Audience;
use crate::counters::SharedCounters;
use crate::messages::{put, refuse, reply};
use diagnosis::messages::Speaker;

/// Something that is superseded soon, or asked for again.
pub(crate) type RoutineMessage = process::Routine<Query>;

/// What the thread owns.
pub(crate) struct RoutinePublisher {
    divergences: Publisher<'static>,
    corrected: Publisher<'static>,
    capability: Publisher<'static>,
    status: Publisher<'static>,
    progress: Publisher<'static>,
    audiences: Audiences,
    inquiries: Arc<SharedCounters<InquiryCounters>>,
}

/// The subscribers of frequent messages.
#[derive(Debug, Clone)]
pub(crate) struct Audiences {
    /// To divergences.
    pub(crate) divergences: Audience,
    /// To corrected readings.
    pub(crate) corrected: Audience,
    /// To progress.
    pub(crate) progress: Audience,
}

impl RoutinePublisher {
    /// Declares the publishers.
    pub(crate) async fn declare(
        session: &Session,
        speaker: &Speaker,
        inquiries: Arc<SharedCounters<InquiryCounters>>,
    ) -> zenoh::Result<Self> {
        let divergences = publisher(session, speaker.key(Topic::Divergence)).await?;
        let corrected = publisher(session, speaker.key(Topic::Corrected)).await?;
        let capability = publisher(session, speaker.key(Topic::Capability)).await?;
        let progress = publisher(session, speaker.key(Topic::Progress)).await?;
        let audiences = Audiences {
            divergences: Audience::of(&divergences).await?,
            corrected: Audience::of(&corrected).await?,
            progress: Audience::of(&progress).await?,
        };
        let status = publisher(session, speaker.key(Topic::Status)).await?;
        Ok(Self { divergences, corrected, capability, status, progress, audiences, inquiries })
    }

    /// The subscribers.
    pub(crate) fn audiences(&self) -> Audiences {
        self.audiences.clone()
    }

    /// Carries messages until every sender is gone.
    pub(crate) fn run(&self, mut queue: mpsc::Receiver<RoutineMessage>, lane: &Lane) {
        while let Some(message) = queue.blocking_recv() {
            lane.begin();
            self.carry(message);
            lane.rest();
        }
    }

    fn carry(&self, message: RoutineMessage) {
        match message {
            RoutineMessage::Divergences(message) => {
                put(&message, |bytes| self.divergences.put(bytes).wait());
            }
            RoutineMessage::Corrected(message) => {
                put(&message, |bytes| self.corrected.put(bytes).wait())
            }
            RoutineMessage::Capability(message) => {
                put(&message, |bytes| self.capability.put(bytes).wait());
            }
            RoutineMessage::Status(message) => {
                put(&*message, |bytes| self.status.put(bytes).wait())
            }
            RoutineMessage::Progress(message) => {
                put(&message, |bytes| self.progress.put(bytes).wait())
            }
            RoutineMessage::Answer { query, answer } => {
                reply(&query, &answer);
                self.inquiries.count(|counters| counters.answered += 1);
            }
            RoutineMessage::Refusal { query, reason } => refuse(&query, reason),
        }
    }
}

/// Declares a publisher of messages that are soon superseded, and therefore dropped under congestion.
async fn publisher(session: &Session, key: String) -> zenoh::Result<Publisher<'static>> {
    session
        .declare_publisher(key)
        .encoding(Encoding::APPLICATION_JSON)
        .congestion_control(CongestionControl::Drop)
        .await
}
