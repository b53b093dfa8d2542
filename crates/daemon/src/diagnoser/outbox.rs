//! Everything that goes out, in order, on a thread of its own.
//!
//! Fault transitions and changes are sent so that the network may hold the sender up rather than lose
//! them; the diagnosis must not be held up, hence the thread. Half of the queue is kept free for them.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use tokio::sync::{mpsc, oneshot};
use truss::ids::Component;
use wire::{
    Divergences, FaultTransition, Message, ModuleStatus, Progress, PublisherCounters, Refused,
    StateAnswer, Topic,
};
use zenoh::bytes::Encoding;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::Query;
use zenoh::{Session, Wait};
use zenoh_ext::{AdvancedPublisher, AdvancedPublisherBuilderExt, CacheConfig, MissDetectionConfig};

use super::fault_book::FaultBook;
use crate::config::PublishSettings;
use crate::convert::Speaker;
use crate::occurrences::worth_a_line;

const QUEUE: usize = 8192;
/// Whoever listens learns after at most this time that it missed the latest message.
const HEARTBEAT: Duration = Duration::from_millis(500);

/// Something that goes out.
#[derive(Debug)]
pub(crate) enum Outgoing {
    /// A transition of the verdict on a component.
    Fault(Box<FaultTransition>),
    /// A change.
    Change(Box<wire::Change>),
    /// Divergences.
    Divergences(Divergences),
    /// Status.
    Status(Box<ModuleStatus>),
    /// Progress.
    Progress(Progress),
    /// The answer to a peer's question.
    Answer {
        /// The question.
        query: Query,
        /// The answer.
        answer: StateAnswer,
    },
    /// No answer.
    Refusal {
        /// The question.
        query: Query,
        /// Why.
        reason: String,
    },
    /// Somebody wants to know the present states.
    States {
        /// The question.
        query: Query,
    },
}

#[derive(Debug, Default)]
struct Counters {
    events: AtomicU64,
    events_lost: AtomicU64,
    turned_away: AtomicU64,
}

/// Takes what is to go out; never waits.
#[derive(Debug, Clone)]
pub(crate) struct Outbox {
    queue: mpsc::Sender<Outgoing>,
    counters: Arc<Counters>,
}

impl Outbox {
    /// Declares the publishers and starts the thread, which ends when all outboxes are gone; then
    /// the receiver is told.
    pub(crate) async fn open(
        session: &Session,
        speaker: &Speaker,
        components: &[Component],
        settings: &PublishSettings,
    ) -> zenoh::Result<(Self, oneshot::Receiver<()>)> {
        let carrier = Carrier::declare(session, speaker, components, settings).await?;
        let (queue, out) = mpsc::channel(QUEUE);
        let (ending, drained) = oneshot::channel();
        let thread = std::thread::Builder::new().name("outbox".to_owned());
        thread.spawn(move || {
            carrier.run(out);
            // Nobody listens any more if the process is in a hurry.
            let _ = ending.send(());
        })?;
        Ok((Self { queue, counters: Arc::default() }, drained))
    }

    /// A message that must not be lost.
    pub(crate) fn event(&self, event: Outgoing) {
        self.counters.events.fetch_add(1, Ordering::Relaxed);
        if self.queue.try_send(event).is_err() {
            let lost = self.counters.events_lost.fetch_add(1, Ordering::Relaxed) + 1;
            if worth_a_line(lost) {
                tracing::error!(times = lost, "event lost: the network takes nothing");
            }
        }
    }

    /// A message that is dropped while events wait.
    pub(crate) fn routine(&self, message: Outgoing) {
        if self.queue.capacity() > QUEUE / 2 {
            // Cannot be full: half of it is free.
            let _ = self.queue.try_send(message);
        }
    }

    /// Refuses a question because too many are waiting.
    pub(crate) fn turn_away(&self, query: Query) {
        self.counters.turned_away.fetch_add(1, Ordering::Relaxed);
        self.routine(Outgoing::Refusal { query, reason: "too many questions are waiting".into() });
    }

    pub(crate) fn counters(&self) -> PublisherCounters {
        let read = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        PublisherCounters {
            events: read(&self.counters.events),
            events_lost: read(&self.counters.events_lost),
            questions_turned_away: read(&self.counters.turned_away),
        }
    }
}

/// What the thread owns.
struct Carrier {
    faults: Vec<(Component, AdvancedPublisher<'static>)>,
    changes: AdvancedPublisher<'static>,
    divergences: Publisher<'static>,
    status: Publisher<'static>,
    progress: Publisher<'static>,
    book: FaultBook,
    state_key: String,
}

impl Carrier {
    async fn declare(
        session: &Session,
        speaker: &Speaker,
        components: &[Component],
        settings: &PublishSettings,
    ) -> zenoh::Result<Self> {
        let mut faults = Vec::with_capacity(components.len());
        for component in components {
            let key = speaker.key(Topic::Fault(component.clone()));
            faults.push((component.clone(), events(session, key, settings.history).await?));
        }
        Ok(Self {
            faults,
            changes: events(session, speaker.key(Topic::Change), settings.history).await?,
            divergences: routine(session, speaker.key(Topic::Divergence)).await?,
            status: routine(session, speaker.key(Topic::Status)).await?,
            progress: routine(session, speaker.key(Topic::Progress)).await?,
            book: FaultBook::new(speaker, components),
            state_key: speaker.key(Topic::State),
        })
    }

    fn run(mut self, mut queue: mpsc::Receiver<Outgoing>) {
        while let Some(outgoing) = queue.blocking_recv() {
            self.carry(outgoing);
        }
    }

    fn carry(&mut self, outgoing: Outgoing) {
        match outgoing {
            Outgoing::Fault(transition) => self.fault(&transition),
            Outgoing::Change(change) => {
                put(&*change, |bytes| self.changes.put(bytes).wait());
            }
            Outgoing::Divergences(divergences) => {
                put(&divergences, |bytes| self.divergences.put(bytes).wait());
            }
            Outgoing::Status(status) => put(&*status, |bytes| self.status.put(bytes).wait()),
            Outgoing::Progress(progress) => put(&progress, |bytes| self.progress.put(bytes).wait()),
            Outgoing::Answer { query, answer } => put(&answer, |bytes| {
                query.reply(&self.state_key, bytes).encoding(Encoding::APPLICATION_JSON).wait()
            }),
            Outgoing::Refusal { query, reason } => refuse(&query, reason),
            Outgoing::States { query } => self.states(&query),
        }
    }

    fn fault(&mut self, transition: &FaultTransition) {
        self.book.enter(transition);
        let component = &transition.component.component;
        let publisher = self.faults.iter().find(|(known, _)| known == component);
        if let Some((_, publisher)) = publisher {
            put(transition, |bytes| publisher.put(bytes).wait());
        }
    }

    fn states(&self, query: &Query) {
        for (key, state) in self.book.asked(query.key_expr()) {
            put(&state, |bytes| {
                query.reply(key, bytes).encoding(Encoding::APPLICATION_JSON).wait()
            });
        }
    }
}

/// A publisher of events: they may hold the sender up, go first, and late listeners get them too.
async fn events(
    session: &Session,
    key: String,
    history: usize,
) -> zenoh::Result<AdvancedPublisher<'static>> {
    session
        .declare_publisher(key)
        .encoding(Encoding::APPLICATION_JSON)
        .congestion_control(CongestionControl::Block)
        .priority(Priority::RealTime)
        .cache(CacheConfig::default().max_samples(history))
        .sample_miss_detection(MissDetectionConfig::default().sporadic_heartbeat(HEARTBEAT))
        .publisher_detection()
        .await
}

/// A publisher of what is superseded soon: dropped rather than waited for.
async fn routine(session: &Session, key: String) -> zenoh::Result<Publisher<'static>> {
    session
        .declare_publisher(key)
        .encoding(Encoding::APPLICATION_JSON)
        .congestion_control(CongestionControl::Drop)
        .await
}

pub(crate) fn refuse(query: &Query, reason: String) {
    put(&Refused { reason }, |bytes| {
        query.reply_err(bytes).encoding(Encoding::APPLICATION_JSON).wait()
    });
}

/// Encodes and hands over. A session that is closing takes nothing; there is nobody to tell but the
/// log.
pub(crate) fn put<M: Message>(message: &M, send: impl FnOnce(Vec<u8>) -> zenoh::Result<()>) {
    match wire::encode(message) {
        Ok(bytes) => {
            if let Err(error) = send(bytes) {
                tracing::debug!("{} not sent: {error}", M::WHAT);
            }
        }
        Err(error) => tracing::error!("{error}"),
    }
}
