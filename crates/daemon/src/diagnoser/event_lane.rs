//! What must not be lost, in order, on a thread of its own: into the journal first, then onto the
//! network.
//!
//! Everything that waits is written in one go and waited for once, so that a burst costs one wait for
//! the disk. The network may hold this thread up; diagnosis and answers to peers are elsewhere.

use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use tokio::sync::OwnedSemaphorePermit;
use truss::ids::{Component, RunId};
use wire::{FaultTransition, Obeyed, PhaseChange, StateChange, Topic};
use zenoh::query::Query;
use zenoh::{Session, Wait};
use zenoh_ext::AdvancedPublisher;

use super::fault_book::FaultBook;
use super::publishers::events;
use super::state::{Keeper, Record};
use crate::config::PublishSettings;
use crate::convert::Speaker;
use crate::messages::{put, reply};

/// Most events written in one go.
const BATCH: usize = 256;
/// How often a disk that refused is tried again.
const RETRY: Duration = Duration::from_secs(1);

/// Something that must not be lost.
#[derive(Debug)]
pub(crate) enum Event {
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
    /// Somebody wants to know the present states.
    States {
        /// The question.
        query: Query,
        /// Its place among those that may wait; free when the question is done with.
        place: OwnedSemaphorePermit,
    },
}

impl Event {
    fn to_record(&self) -> Option<Record> {
        match self {
            Event::Fault(transition) => Some(Record::Transition(transition.clone())),
            Event::Settled { run, change } => {
                Some(Record::Change { run: *run, change: change.clone() })
            }
            Event::Change(_) | Event::Phase(_) | Event::Obeyed { .. } | Event::States { .. } => {
                None
            }
        }
    }
}

/// What the thread owns.
pub(crate) struct EventLane {
    keeper: Keeper,
    book: FaultBook,
    faults: Vec<(Component, AdvancedPublisher<'static>)>,
    changes: AdvancedPublisher<'static>,
    phases: AdvancedPublisher<'static>,
}

impl EventLane {
    /// Declares the publishers.
    pub(crate) async fn declare(
        session: &Session,
        speaker: &Speaker,
        components: &[Component],
        settings: &PublishSettings,
        keeper: Keeper,
    ) -> zenoh::Result<Self> {
        let mut faults = Vec::with_capacity(components.len());
        for component in components {
            let key = speaker.key(Topic::Fault(component.clone()));
            faults.push((component.clone(), events(session, key, settings.history).await?));
        }
        Ok(Self {
            keeper,
            book: FaultBook::new(speaker, components),
            faults,
            changes: events(session, speaker.key(Topic::Change), settings.history).await?,
            phases: events(session, speaker.key(Topic::Phase), settings.history).await?,
        })
    }

    /// Tells once more what was told before the restart: whoever was listening then may not have got
    /// the last of it, and late listeners get it from here.
    pub(crate) fn repeat(&mut self, latest: Vec<FaultTransition>) {
        for transition in latest {
            self.fault(&transition);
        }
    }

    /// Carries events until nobody can send any more.
    pub(crate) fn run(mut self, queue: &Receiver<Event>) {
        loop {
            let first = if self.keeper.is_behind() {
                queue.recv_timeout(RETRY)
            } else {
                queue.recv().map_err(|_| RecvTimeoutError::Disconnected)
            };
            match first {
                Ok(first) => {
                    let more = queue.try_iter().take(BATCH - 1);
                    let batch: Vec<Event> = std::iter::once(first).chain(more).collect();
                    self.carry(batch);
                }
                Err(RecvTimeoutError::Timeout) => {
                    self.keeper.save(&[]);
                }
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    fn carry(&mut self, mut batch: Vec<Event>) {
        let records: Vec<Record> = batch.iter().filter_map(Event::to_record).collect();
        let durable = records.is_empty() || self.keeper.save(&records);
        for event in &mut batch {
            if let Event::Fault(transition) = event {
                transition.durable = durable;
            }
        }
        batch.into_iter().for_each(|event| self.send(event));
    }

    fn send(&mut self, event: Event) {
        match event {
            Event::Fault(transition) => self.fault(&transition),
            Event::Change(change) => put(&*change, |bytes| self.changes.put(bytes).wait()),
            Event::Settled { .. } => {}
            Event::Phase(change) => put(&*change, |bytes| self.phases.put(bytes).wait()),
            Event::Obeyed { query, obeyed } => reply(&query, &obeyed),
            Event::States { query, place } => {
                self.states(&query);
                drop(place);
            }
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
                query.reply(key, bytes).encoding(zenoh::bytes::Encoding::APPLICATION_JSON).wait()
            });
        }
    }
}
