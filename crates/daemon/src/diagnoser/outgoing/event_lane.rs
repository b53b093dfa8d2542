//! What must not be lost, in order, on a thread of its own: into the journal first, then onto the
//! network.
//!
//! Everything that waits is written in one go and waited for once, so that a burst costs one wait for
//! the disk. The network may hold this thread up; diagnosis and answers to peers are elsewhere.

use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use names::{Component, RunId};
use tokio::sync::OwnedSemaphorePermit;
use wire::{FaultTransition, Obeyed, PhaseChange, StateChange, Topic};
use zenoh::bytes::Encoding;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::Query;
use zenoh::{Session, Wait};
use zenoh_ext::{AdvancedPublisher, AdvancedPublisherBuilderExt, CacheConfig, MissDetectionConfig};

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
}

impl Outgoing {
    fn to_record(&self) -> Option<Record> {
        match self {
            Outgoing::Fault(transition) => Some(Record::Transition(transition.clone())),
            Outgoing::Settled { run, change } => {
                Some(Record::Change { run: *run, change: change.clone() })
            }
            Outgoing::Change(_)
            | Outgoing::Phase(_)
            | Outgoing::Obeyed { .. }
            | Outgoing::States { .. } => None,
        }
    }
}

/// What the thread owns.
pub(crate) struct EventLane {
    keeper: Keeper,
    states: States,
    faults: Vec<(Component, AdvancedPublisher<'static>)>,
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
        states: States,
    ) -> zenoh::Result<Self> {
        let mut faults = Vec::new();
        for component in states.components() {
            let key = speaker.key(Topic::Fault(component.clone()));
            faults.push((component.clone(), publisher(session, key, settings.history).await?));
        }
        Ok(Self {
            keeper,
            states,
            faults,
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

    fn carry(&mut self, mut batch: Vec<Outgoing>) {
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
            Outgoing::Change(change) => put(&*change, |bytes| self.changes.put(bytes).wait()),
            Outgoing::Settled { .. } => {}
            Outgoing::Phase(change) => put(&*change, |bytes| self.phases.put(bytes).wait()),
            Outgoing::Obeyed { query, obeyed } => reply(&query, &obeyed),
            Outgoing::States { query, place } => {
                self.states(&query);
                drop(place);
            }
        }
    }

    fn fault(&mut self, transition: &FaultTransition) {
        self.states.enter(transition);
        let component = &transition.component.component;
        let publisher = self.faults.iter().find(|(known, _)| known == component);
        if let Some((_, publisher)) = publisher {
            put(transition, |bytes| publisher.put(bytes).wait());
        }
    }

    fn states(&self, query: &Query) {
        for (key, state) in self.states.covered_by(query.key_expr()) {
            put(&state, |bytes| {
                query.reply(key, bytes).encoding(Encoding::APPLICATION_JSON).wait()
            });
        }
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
