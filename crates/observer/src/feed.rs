//! Verdicts, phases and presence, as they are published.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use names::{ModuleName, StructureName};
use tokio::sync::mpsc::{Receiver, Sender, channel};
use wire::keys::{PLANT, Watched};
use wire::{
    DecodeError, FaultTransition, Identification, Key, Message, ModuleStatus, PhaseChange,
    PlantTopic, Topic,
};
use zenoh::Session;
use zenoh::sample::{Sample, SampleKind};
use zenoh_ext::{AdvancedSubscriberBuilderExt, HistoryConfig, RecoveryConfig};

use super::presence::AttendanceError;

/// Events that may wait to be taken.
const QUEUE: usize = 4096;
/// That several processes run as one module is reported again only if it was over for this long.
const OVER: Duration = Duration::from_secs(60);
/// Modules of which that is remembered.
const REMEMBERED: usize = 1024;

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
    /// A diagnoser knows of another process that runs as the same module.
    SeveralProcesses {
        /// The structure.
        structure: StructureName,
        /// The module.
        module: ModuleName,
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
        let latest = Mutex::new(BTreeMap::new());
        session
            .declare_subscriber(watched.statuses())
            .callback(hand_to(outbox.clone(), move |status| several(&latest, status)))
            .background()
            .await
            .map_err(refused)?;
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

/// When each module was last said to be several processes.
type Latest = BTreeMap<(StructureName, ModuleName), Instant>;

/// Whether a status is the first to say that several processes run as its module.
fn several(latest: &Mutex<Latest>, sample: &Sample) -> Option<News> {
    let status: ModuleStatus = wire::decode(&sample.payload().to_bytes()).ok()?;
    let ModuleStatus { structure, module, another_process: true, .. } = status else { return None };
    let mut latest = latest.lock().unwrap_or_else(PoisonError::into_inner);
    is_first(&mut latest, (structure.clone(), module.clone()), Instant::now())
        .then_some(News::SeveralProcesses { structure, module })
}

fn is_first(latest: &mut Latest, module: (StructureName, ModuleName), now: Instant) -> bool {
    if latest.len() >= REMEMBERED {
        latest.clear();
    }
    latest.insert(module, now).is_none_or(|before| now.duration_since(before) >= OVER)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_processes_are_reported_once_for_as_long_as_there_are_several() {
        let (mut latest, start) = (Latest::new(), Instant::now());
        let mut at = |module: &str, second| {
            let module = ("tower".parse().unwrap(), module.parse().unwrap());
            is_first(&mut latest, module, start + Duration::from_secs(second))
        };
        let reported: Vec<u64> = (0..100).filter(|second| at("m1", *second)).collect();
        assert_eq!(reported, [0]);
        assert!(at("m2", 100), "another module");
        assert!(!at("m1", 158));
        assert!(at("m1", 218), "it was over meanwhile");
    }
}
