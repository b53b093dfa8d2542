//! What must not be lost, in order, on a thread of its own: into the journal first, then onto the
//! network.
//!
//! Everything that waits is written in one go and waited for once, so that a burst costs one wait for
//! the disk. The network may hold this thread up; diagnosis and answers to peers are elsewhere.

use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use names::{Component, RunId};
use tokio::sync::OwnedSemaphorePermit;
use wire::{
    Candidate, FaultSize, FaultTransition, Identification, Obeyed, PhaseChange, StateChange, Topic,
};
use zenoh::bytes::Encoding;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::Query;
use zenoh::{Session, Wait};
use zenoh_ext::{AdvancedPublisher, AdvancedPublisherBuilderExt, CacheConfig, MissDetectionConfig};

use super::identified_faults::IdentifiedFaults;
use super::states::States;
use crate::config::PublishSettings;
use crate::convert::Speaker;
use crate::diagnoser::state::{Keeper, Record};
use crate::messages::{put, reply};

/// Most events written in one go.
const BATCH: usize = 256;
/// A subscriber detects after at most this time that it missed the latest message.
const HEARTBEAT: Duration = Duration::from_millis(500);
/// How often a disk that refused is tried again.
const RETRY: Duration = Duration::from_secs(1);

/// Something that must not be lost.
#[derive(Debug)]
pub(crate) enum Outgoing {
    /// A transition of the verdict on a component.
    Fault(Box<FaultTransition>),
    /// What was found of a fault. It is published and written down if it is news.
    Identification(Box<Identification>),
    /// A change.
    Change(Box<wire::Change>),
    /// A change whose ratio is final: for the journal only.
    Settled {
        /// The run that its step is counted in.
        run: RunId,
        /// The change.
        change: StateChange,
    },
    /// Another phase.
    Phase(Box<PhaseChange>),
    /// An order was obeyed by a transition before this.
    Obeyed {
        /// The order.
        query: Query,
        /// The reply.
        obeyed: Obeyed,
    },
    /// A query for the present states.
    States {
        /// The question.
        query: Query,
        /// Its place among those that may wait; free when the question is done with.
        place: OwnedSemaphorePermit,
    },
    /// A query for the latest identifications.
    Identifications {
        /// The question.
        query: Query,
        /// Its place among those that may wait; free when the question is done with.
        place: OwnedSemaphorePermit,
    },
}

impl Outgoing {
    fn to_record(&self) -> Option<Record> {
        match self {
            Outgoing::Fault(transition) => Some(Record::Transition(transition.clone())),
            Outgoing::Identification(found) => Some(Record::Identification(found.clone())),
            Outgoing::Settled { run, change } => {
                Some(Record::Change { run: *run, change: change.clone() })
            }
            Outgoing::Change(_)
            | Outgoing::Phase(_)
            | Outgoing::Obeyed { .. }
            | Outgoing::States { .. }
            | Outgoing::Identifications { .. } => None,
        }
    }
}

/// What is known of the components, for those who ask.
pub(crate) struct Books {
    pub(crate) states: States,
    pub(crate) faults: IdentifiedFaults,
}

/// The publishers of what concerns one component.
struct ComponentPublishers {
    faults: AdvancedPublisher<'static>,
    identifications: AdvancedPublisher<'static>,
}

/// What the thread owns.
pub(crate) struct EventLane {
    keeper: Keeper,
    books: Books,
    publishers: Vec<(Component, ComponentPublishers)>,
    changes: AdvancedPublisher<'static>,
    phases: AdvancedPublisher<'static>,
}

impl EventLane {
    /// Declares the publishers.
    pub(crate) async fn declare(
        session: &Session,
        speaker: &Speaker,
        settings: &PublishSettings,
        keeper: Keeper,
        books: Books,
    ) -> zenoh::Result<Self> {
        let mut publishers = Vec::new();
        for component in books.states.components() {
            let faults = speaker.key(Topic::Fault(component.clone()));
            let identifications = speaker.key(Topic::Identification(component.clone()));
            let of_component = ComponentPublishers {
                faults: publisher(session, faults, settings.history).await?,
                identifications: publisher(session, identifications, settings.history).await?,
            };
            publishers.push((component.clone(), of_component));
        }
        Ok(Self {
            keeper,
            books,
            publishers,
            changes: publisher(session, speaker.key(Topic::Change), settings.history).await?,
            phases: publisher(session, speaker.key(Topic::Phase), settings.history).await?,
        })
    }

    /// Publishes again what was published before the restart: subscribers may not have received
    /// the last of it, and late subscribers get it from here.
    pub(crate) fn repeat(&mut self, latest: Vec<FaultTransition>) {
        for transition in latest {
            self.fault(&transition);
        }
        for identification in self.books.faults.published() {
            self.identification(&identification);
        }
    }

    /// Carries events until every sender is gone.
    pub(crate) fn run(mut self, queue: &Receiver<Outgoing>) {
        loop {
            let first = if self.keeper.is_behind() {
                queue.recv_timeout(RETRY)
            } else {
                queue.recv().map_err(|_| RecvTimeoutError::Disconnected)
            };
            match first {
                Ok(first) => {
                    let more = queue.try_iter().take(BATCH - 1);
                    let batch: Vec<Outgoing> = std::iter::once(first).chain(more).collect();
                    self.carry(batch);
                }
                Err(RecvTimeoutError::Timeout) => {
                    self.keeper.save(&[]);
                }
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    fn carry(&mut self, batch: Vec<Outgoing>) {
        let faults = &mut self.books.faults;
        let mut batch: Vec<_> = batch.into_iter().filter_map(|event| faults.note(event)).collect();
        let records: Vec<Record> = batch.iter().filter_map(Outgoing::to_record).collect();
        let durable = records.is_empty() || self.keeper.save(&records);
        for event in &mut batch {
            if let Outgoing::Fault(transition) = event {
                transition.durable = durable;
            }
        }
        batch.into_iter().for_each(|event| self.send(event));
    }

    fn send(&mut self, event: Outgoing) {
        match event {
            Outgoing::Fault(transition) => self.fault(&transition),
            Outgoing::Identification(found) => {
                self.books.faults.count_published();
                tell(&found);
                self.identification(&found);
            }
            Outgoing::Change(change) => put(&*change, |bytes| self.changes.put(bytes).wait()),
            Outgoing::Settled { .. } => {}
            Outgoing::Phase(change) => put(&*change, |bytes| self.phases.put(bytes).wait()),
            Outgoing::Obeyed { query, obeyed } => reply(&query, &obeyed),
            Outgoing::States { query, place } => {
                self.states(&query);
                drop(place);
            }
            Outgoing::Identifications { query, place } => {
                self.identifications(&query);
                drop(place);
            }
        }
    }

    fn fault(&mut self, transition: &FaultTransition) {
        self.books.states.enter(transition);
        if let Some(publishers) = self.publishers_of(&transition.component.component) {
            put(transition, |bytes| publishers.faults.put(bytes).wait());
        }
    }

    fn identification(&self, found: &Identification) {
        if let Some(publishers) = self.publishers_of(&found.component.component) {
            put(found, |bytes| publishers.identifications.put(bytes).wait());
        }
    }

    fn publishers_of(&self, component: &Component) -> Option<&ComponentPublishers> {
        let of_component = self.publishers.iter().find(|(known, _)| known == component);
        of_component.map(|(_, publishers)| publishers)
    }

    fn states(&self, query: &Query) {
        for (key, state) in self.books.states.covered_by(query.key_expr()) {
            let state = self.books.faults.completed(state);
            put(&state, |bytes| {
                query.reply(key, bytes).encoding(Encoding::APPLICATION_JSON).wait()
            });
        }
    }

    fn identifications(&self, query: &Query) {
        for (key, latest) in self.books.faults.covered_by(query.key_expr()) {
            put(latest, |bytes| {
                query.reply(key, bytes).encoding(Encoding::APPLICATION_JSON).wait()
            });
        }
    }
}

/// Logs what was found.
fn tell(found: &Identification) {
    let Identification { component, as_of_step, .. } = found;
    let kinds: Vec<String> = found.candidates.iter().map(in_words).collect();
    match (found.kind(), found.candidates.first()) {
        (Some(kind), _) => {
            let probability = kind.probability;
            tracing::info!(%component, %as_of_step, probability, "identified: {}", in_words(kind));
        }
        (None, Some(Candidate { probability, .. })) => {
            let kinds = kinds.join(", or ");
            tracing::info!(%component, %as_of_step, probability, "not yet identified: {kinds}");
        }
        (None, None) => tracing::info!(%component, %as_of_step, "could not be identified"),
    }
}

fn in_words(candidate: &Candidate) -> String {
    let Candidate { kind, size, .. } = candidate;
    match size {
        Some(FaultSize { value, low, high, unit }) => {
            let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
            format!("{kind}, {value:.3e}{unit} ({low:.3e} to {high:.3e})")
        }
        None => kind.clone(),
    }
}

/// A publisher of events: they may hold the sender up, go first, and late subscribers get them too.
async fn publisher(
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
