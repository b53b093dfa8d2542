//! Publishes what must not be lost, in order, on a thread of its own. Each event waits until the disk has what was stored
//! before it, but not for a disk that hangs (`process::WriteQueue`).
//!
//! The network may hold this thread up: diagnosis, replies and the journal, which has everything already, are elsewhere.

use std::sync::Arc;
use std::sync::mpsc::Receiver;

use shell::supervision::Lane;
use vocabulary::{
    Candidate, Component, FaultSize, FaultTransition, Identification, Input, InquiryCounters, Topic,
};
use zenoh::bytes::{Encoding, ZBytes};
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::Query;
use zenoh::{Session, Wait};

use super::{Audience, InputCache};
use crate::counters::SharedCounters;
use crate::diagnoser::identify::IdentificationReport;
use crate::diagnoser::store::ModuleStore;
use crate::messages::{put, reply};
use diagnosis::messages::Speaker;

/// Something that must not be lost.
pub(crate) type OutgoingEvent = process::Outgoing<Query>;

/// An event that is in the store.
pub(crate) type WaitingEvent = process::QueuedEvent<Query>;

/// The publishers of a component's messages.
struct ComponentPublishers {
    faults: Publisher<'static>,
    identifications: Publisher<'static>,
}

/// What the thread owns.
pub(crate) struct EventPublisher {
    store: ModuleStore,
    inquiries: Arc<SharedCounters<InquiryCounters>>,
    identifications: Arc<SharedCounters<IdentificationReport>>,
    publishers: Vec<(Component, ComponentPublishers)>,
    changes: Publisher<'static>,
    phases: Publisher<'static>,
    inputs: InputPublisher,
}

/// Publishes inputs to subscribers, and keeps them for queries.
struct InputPublisher {
    publisher: Publisher<'static>,
    audience: Audience,
    cache: InputCache,
}

impl EventPublisher {
    /// Declares the publishers.
    pub(crate) async fn declare(
        session: &Session,
        (speaker, components): (&Speaker, &[Component]),
        (store, cache): (ModuleStore, InputCache),
        inquiries: &Arc<SharedCounters<InquiryCounters>>,
        identifications: &Arc<SharedCounters<IdentificationReport>>,
    ) -> zenoh::Result<Self> {
        let mut publishers = Vec::new();
        for component in components {
            let faults = speaker.key(Topic::Fault(component.clone()));
            let identifications = speaker.key(Topic::Identification(component.clone()));
            let of_component = ComponentPublishers {
                faults: publisher(session, faults).await?,
                identifications: publisher(session, identifications).await?,
            };
            publishers.push((component.clone(), of_component));
        }
        Ok(Self {
            store,
            inquiries: Arc::clone(inquiries),
            identifications: Arc::clone(identifications),
            publishers,
            changes: publisher(session, speaker.key(Topic::Change)).await?,
            phases: publisher(session, speaker.key(Topic::Phase)).await?,
            inputs: InputPublisher::declare(session, speaker, cache).await?,
        })
    }

    /// Publishes again what was published before the restart: subscribers that are connected by now may not have
    /// received the last of it.
    pub(crate) fn repeat(&self) {
        let (transitions, identifications) = self.store.lock().components.published();
        transitions.iter().for_each(|transition| self.fault(transition));
        identifications.iter().for_each(|identification| self.identification(identification));
    }

    /// Publishes events until every sender is gone.
    pub(super) fn run(self, queue: &Receiver<WaitingEvent>, lane: &Lane) {
        publish(queue, &self.store, lane, |event| self.send(event));
    }

    fn send(&self, event: OutgoingEvent) {
        match event {
            OutgoingEvent::Fault(transition) => self.fault(&transition),
            OutgoingEvent::Identification(found) => {
                self.identifications.count(|counters| counters.published += 1);
                tell(&found);
                self.identification(&found);
            }
            OutgoingEvent::Change(change) => put(&*change, |bytes| self.changes.put(bytes).wait()),
            OutgoingEvent::Phase(change) => put(&*change, |bytes| self.phases.put(bytes).wait()),
            OutgoingEvent::Obeyed { query, obeyed } => {
                reply(&query, &obeyed);
                self.inquiries.count(|counters| counters.answered += 1);
            }
            OutgoingEvent::Input(input) => self.inputs.tell(&input),
        }
    }

    fn fault(&self, transition: &FaultTransition) {
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
}

/// Publishes events in their order, each once the disk has it or is given up.
pub(super) fn publish(
    queue: &Receiver<WaitingEvent>,
    store: &ModuleStore,
    lane: &Lane,
    send: impl Fn(OutgoingEvent),
) {
    while let Ok(WaitingEvent { mut event, ticket }) = queue.recv() {
        lane.begin();
        event.set_durable(store.wait_for(ticket));
        send(event);
        lane.rest();
    }
}

impl InputPublisher {
    /// One that the network does not take at once is not waited for: its number shows that it is missing, and it can be
    /// asked for.
    async fn declare(
        session: &Session,
        speaker: &Speaker,
        cache: InputCache,
    ) -> zenoh::Result<Self> {
        let publisher = session
            .declare_publisher(speaker.key(Topic::Input))
            .encoding(Encoding::APPLICATION_JSON)
            .congestion_control(CongestionControl::Drop)
            .priority(Priority::RealTime)
            .await?;
        let audience = Audience::of(&publisher).await?;
        Ok(Self { publisher, audience, cache })
    }

    fn tell(&self, input: &Input) {
        put(input, |bytes| {
            let bytes = ZBytes::from(bytes);
            self.cache.keep(input.number, bytes.clone());
            if self.audience.is_there() { self.publisher.put(bytes).wait() } else { Ok(()) }
        });
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
        Some(FaultSize { value, low, high, own_unit }) => {
            let unit = kind.size_unit().filter(|unit| *unit != "1" && !own_unit);
            let unit = unit.map_or_else(String::new, |unit| format!(" {unit}"));
            format!("{kind}, {value:.3e}{unit} ({low:.3e} to {high:.3e})")
        }
        None => kind.to_string(),
    }
}

/// A publisher of events: they may hold the sender up, and go first.
async fn publisher(session: &Session, key: String) -> zenoh::Result<Publisher<'static>> {
    session
        .declare_publisher(key)
        .encoding(Encoding::APPLICATION_JSON)
        .congestion_control(CongestionControl::Block)
        .priority(Priority::RealTime)
        .await
}
