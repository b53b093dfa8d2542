//! Verdicts, phases and presence, as they are published.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use names::StructureName;
use tokio::sync::mpsc::{Receiver, Sender, channel};
use wire::keys::{PLANT, Watched};
use wire::{
    DecodeError, FaultTransition, Identification, Key, Message, PhaseChange, PlantTopic, Topic,
};
use zenoh::Session;
use zenoh::sample::{Sample, SampleKind};
use zenoh_ext::{AdvancedSubscriberBuilderExt, HistoryConfig, RecoveryConfig};

use super::presence::AttendanceError;

/// Events that may wait to be taken.
const QUEUE: usize = 4096;

/// An event of the feed.
#[derive(Debug, Clone, PartialEq)]
pub enum News {
    /// A verdict changed.
    Fault(Box<FaultTransition>),
    /// What kind of fault a component has turned out to have.
    Identification(Box<Identification>),
    /// A module entered another phase.
    Phase(PhaseChange),
    /// A process came or went.
    Presence {
        /// The structure.
        structure: StructureName,
        /// The module, or `plant`.
        who: String,
        /// Came, or went.
        there: bool,
    },
    /// What is wrong with a message that could not be read, with its key.
    Unreadable(String),
    /// This many events were lost, because they were not taken in time.
    Lost(u64),
}

/// Events of one structure, or of all. It ends when it is dropped, or with its session.
#[derive(Debug)]
pub struct Feed {
    inbox: Receiver<News>,
    lost: Arc<AtomicU64>,
}

/// Where subscribers put their events. They must not wait, and do not.
#[derive(Debug, Clone)]
struct Outbox {
    sender: Sender<News>,
    lost: Arc<AtomicU64>,
}

impl Outbox {
    fn put(&self, event: News) {
        if self.sender.try_send(event).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl Feed {
    /// Subscribes. The latest of every component and every module comes first.
    ///
    /// # Errors
    /// The network refuses.
    pub async fn open(
        session: &Session,
        structure: Option<&StructureName>,
    ) -> Result<Self, AttendanceError> {
        let refused = |error: zenoh::Error| AttendanceError::Network(error.to_string());
        let (sender, inbox) = channel(QUEUE);
        let lost = Arc::new(AtomicU64::new(0));
        let outbox = Outbox { sender, lost: lost.clone() };
        let watched = Watched { structure, module: None };
        for expression in [watched.faults(), watched.identifications(), watched.phases()] {
            session
                .declare_subscriber(expression)
                .callback(hand_to(outbox.clone(), message))
                .advanced()
                .history(HistoryConfig::default().detect_late_publishers().max_samples(1))
                .recovery(RecoveryConfig::default().heartbeat())
                .background()
                .await
                .map_err(refused)?;
        }
        session
            .liveliness()
            .declare_subscriber(watched.tokens())
            .history(true)
            .callback(hand_to(outbox, presence))
            .background()
            .await
            .map_err(refused)?;
        Ok(Self { inbox, lost })
    }

    /// The next event; `None` once the session is closed.
    pub async fn next(&mut self) -> Option<News> {
        match self.lost.swap(0, Ordering::Relaxed) {
            0 => self.inbox.recv().await,
            lost => Some(News::Lost(lost)),
        }
    }
}

fn hand_to(
    outbox: Outbox,
    read: impl Fn(&Sample) -> Option<News> + Send + Sync + 'static,
) -> impl Fn(Sample) + Send + Sync + 'static {
    move |sample| {
        if let Some(event) = read(&sample) {
            outbox.put(event);
        }
    }
}

/// What a message says, if it is one of those that are of interest.
fn message(sample: &Sample) -> Option<News> {
    let key = sample.key_expr().as_str();
    let bytes = sample.payload().to_bytes();
    let read = match key.parse::<Key>() {
        Ok(Key::Module { topic: Topic::Fault(_), .. }) => {
            decode(&bytes, |transition| News::Fault(Box::new(transition)))
        }
        Ok(Key::Module { topic: Topic::Identification(_), .. }) => {
            decode(&bytes, |found| News::Identification(Box::new(found)))
        }
        Ok(Key::Module { topic: Topic::Phase, .. }) => decode(&bytes, News::Phase),
        Ok(_) => return None,
        Err(error) => Err(error.to_string()),
    };
    Some(read.unwrap_or_else(|problem| News::Unreadable(format!("{key}: {problem}"))))
}

fn decode<M: Message>(bytes: &[u8], event: impl FnOnce(M) -> News) -> Result<News, String> {
    wire::decode(bytes).map(event).map_err(|error: DecodeError| error.to_string())
}

/// Whose token it is that came or went.
fn presence(sample: &Sample) -> Option<News> {
    let (structure, who) = match sample.key_expr().as_str().parse::<Key>().ok()? {
        Key::Module { structure, module, topic: Topic::Alive } => (structure, module.to_string()),
        Key::Plant { structure, topic: PlantTopic::Alive } => (structure, PLANT.to_owned()),
        Key::Module { .. } | Key::Plant { .. } => return None,
    };
    let there = sample.kind() == SampleKind::Put;
    Some(News::Presence { structure, who, there })
}
