//! Publishes what must not be lost, in order, on a thread of its own. Each event waits until the disk has what was stored
//! before it, but not for a disk that hangs (`state::write_queue`).
//!
//! The network may hold this thread up: diagnosis, replies and the journal, which has everything already, are elsewhere.

use std::sync::Arc;
use std::sync::mpsc::Receiver;

use shell::supervision::Lane;
use vocabulary::{
    Candidate, Component, FaultSize, FaultTransition, Identification, Input, Obeyed, PhaseChange,
    Topic,
};
use zenoh::bytes::{Encoding, ZBytes};
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::Query;
use zenoh::{Session, Wait};

use super::audience::Audience;
use super::books::SharedBooks;
use crate::diagnoser::inputs::Shelf;
use crate::diagnoser::inquiry::InquiryTally;
use crate::diagnoser::state::{JournalBoard, Record};
use crate::messages::{put, reply};
use diagnosis::messages::Speaker;

/// Something that must not be lost.
#[derive(Debug)]
pub(crate) enum Outgoing {
    /// A transition of the verdict on a component.
    Fault(Box<FaultTransition>),
    /// What was found of a fault. It is stored and published if it is news.
    Identification(Box<Identification>),
    /// A change.
    Change(Box<vocabulary::ChangeReport>),
    /// Another phase.
    Phase(Box<PhaseChange>),
    /// An order was obeyed by a transition before this.
    Obeyed {
        /// The order.
        query: Query,
        /// The reply.
        obeyed: Obeyed,
    },
    /// What the diagnoser took beside samples: before everything that comes of it.
    Input(Box<Input>),
}

/// An event whose record the journal has been given.
#[derive(Debug)]
pub(crate) struct Stored {
    pub(super) event: Outgoing,
    /// To wait for the disk with.
    pub(super) ticket: u64,
}

impl Outgoing {
    /// What of it outlives the process.
    pub(super) fn to_record(&self) -> Option<Record> {
        match self {
            Outgoing::Fault(transition) => Some(Record::Transition(transition.clone())),
            Outgoing::Identification(found) => Some(Record::Identification(found.clone())),
            Outgoing::Change(_)
            | Outgoing::Phase(_)
            | Outgoing::Obeyed { .. }
            | Outgoing::Input(_) => None,
        }
    }

    pub(super) fn set_durable(&mut self, durable: bool) {
        match self {
            Outgoing::Fault(transition) => transition.durable = durable,
            Outgoing::Obeyed { obeyed, .. } => obeyed.durable = durable,
            _ => {}
        }
    }
}

/// The publishers of what concerns one component.
struct ComponentPublishers {
    faults: Publisher<'static>,
    identifications: Publisher<'static>,
}

/// What the thread owns.
pub(crate) struct EventLane {
    journal: JournalBoard,
    books: SharedBooks,
    inquiries: Arc<InquiryTally>,
    publishers: Vec<(Component, ComponentPublishers)>,
    changes: Publisher<'static>,
    phases: Publisher<'static>,
    inputs: InputPublisher,
}

/// Publishes inputs to whoever subscribes, and keeps them for whoever asks.
struct InputPublisher {
    publisher: Publisher<'static>,
    audience: Audience,
    shelf: Shelf,
}

impl EventLane {
    /// Declares the publishers.
    pub(crate) async fn declare(
        session: &Session,
        speaker: &Speaker,
        journal: JournalBoard,
        (books, shelf): (SharedBooks, Shelf),
        inquiries: Arc<InquiryTally>,
    ) -> zenoh::Result<Self> {
        let mut publishers = Vec::new();
        let components: Vec<Component> = books.lock().states.components().cloned().collect();
        for component in components {
            let faults = speaker.key(Topic::Fault(component.clone()));
            let identifications = speaker.key(Topic::Identification(component.clone()));
            let of_component = ComponentPublishers {
                faults: publisher(session, faults).await?,
                identifications: publisher(session, identifications).await?,
            };
            publishers.push((component, of_component));
        }
        Ok(Self {
            journal,
            books,
            inquiries,
            publishers,
            changes: publisher(session, speaker.key(Topic::Change)).await?,
            phases: publisher(session, speaker.key(Topic::Phase)).await?,
            inputs: InputPublisher::declare(session, speaker, shelf).await?,
        })
    }

    /// Publishes again what was published before the restart: subscribers that are connected by now may not have
    /// received the last of it. From now on it is the present, for whoever asks.
    pub(crate) fn repeat(&self, latest: Vec<FaultTransition>) {
        for transition in latest {
            self.fault(&transition);
        }
        let published = self.books.lock().faults.published();
        for identification in published {
            self.identification(&identification);
        }
    }

    /// Publishes events until every sender is gone.
    pub(crate) fn run(self, queue: &Receiver<Stored>, lane: &Lane) {
        publish(queue, &self.journal, lane, |event| self.send(event));
    }

    fn send(&self, event: Outgoing) {
        match event {
            Outgoing::Fault(transition) => self.fault(&transition),
            Outgoing::Identification(found) => {
                self.books.lock().faults.count_published();
                tell(&found);
                self.identification(&found);
            }
            Outgoing::Change(change) => put(&*change, |bytes| self.changes.put(bytes).wait()),
            Outgoing::Phase(change) => put(&*change, |bytes| self.phases.put(bytes).wait()),
            Outgoing::Obeyed { query, obeyed } => {
                reply(&query, &obeyed);
                self.inquiries.answered();
            }
            Outgoing::Input(input) => self.inputs.tell(&input),
        }
    }

    /// Whoever hears of it and asks gets the same.
    fn fault(&self, transition: &FaultTransition) {
        self.books.lock().states.enter(transition);
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
    queue: &Receiver<Stored>,
    journal: &JournalBoard,
    lane: &Lane,
    send: impl Fn(Outgoing),
) {
    while let Ok(Stored { mut event, ticket }) = queue.recv() {
        lane.begin();
        event.set_durable(journal.wait_for(ticket));
        send(event);
        lane.rest();
    }
}

impl InputPublisher {
    /// One that the network does not take at once is not waited for: its number shows that it is missing, and it can be
    /// asked for.
    async fn declare(session: &Session, speaker: &Speaker, shelf: Shelf) -> zenoh::Result<Self> {
        let publisher = session
            .declare_publisher(speaker.key(Topic::Input))
            .encoding(Encoding::APPLICATION_JSON)
            .congestion_control(CongestionControl::Drop)
            .priority(Priority::RealTime)
            .await?;
        let audience = Audience::of(&publisher).await?;
        Ok(Self { publisher, audience, shelf })
    }

    fn tell(&self, input: &Input) {
        put(input, |bytes| {
            let bytes = ZBytes::from(bytes);
            self.shelf.keep(input.number, bytes.clone());
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
        Some(FaultSize { value, low, high, unit }) => {
            let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
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
