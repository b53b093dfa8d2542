//! The present state of each component, and what of it is still to be written.

use std::time::Instant;

use vocabulary::JournalStatus;

use crate::components::ComponentStore;
use crate::outgoing::{Outgoing, QueuedEvent};
use crate::record::{JournalRecord, WatchedSteps};
use crate::write_queue::{WriteBatch, WriteQueue};

/// What a module's process knows and keeps.
#[derive(Debug)]
pub struct StoreState {
    /// The present state of each component.
    pub components: ComponentStore,
    /// What is to be written.
    pub writes: WriteQueue,
    /// Nothing will be handed in any more.
    pub is_closed: bool,
}

impl StoreState {
    /// With what a journal held, and how that is.
    #[must_use]
    pub fn new(components: ComponentStore, status: JournalStatus) -> Self {
        Self { components, writes: WriteQueue::new(status), is_closed: false }
    }

    /// Takes what is written to the journal and concerns no single component.
    pub fn record(&mut self, record: JournalRecord, now: Instant) {
        self.components.note(record.clone());
        self.writes.hand_in(Some(record), None, now);
    }

    /// Takes how far the module has watched: for the disk, after all before it.
    pub fn watched(&mut self, watch: WatchedSteps, now: Instant) {
        self.writes.hand_in([], Some(watch), now);
    }

    /// Stores an event and hands in what is to be written of it. Returns the event to be published, unless it is no
    /// news.
    pub fn enter<Q>(&mut self, event: Outgoing<Q>, now: Instant) -> Option<QueuedEvent<Q>> {
        let (event, record) = match event {
            Outgoing::Fault(transition) => {
                let inputs = self.components.inputs_of_transition();
                self.writes.hand_in(inputs, None, now);
                let ticket = self.writes.next_ticket();
                let transition = Box::new(self.components.transition(*transition, ticket));
                let record = JournalRecord::Transition(transition.clone());
                (Outgoing::Fault(transition), Some(record))
            }
            Outgoing::Identification(found) => {
                let found = Box::new(self.components.identification(*found)?);
                let record = JournalRecord::Identification(found.clone());
                (Outgoing::Identification(found), Some(record))
            }
            Outgoing::Phase(change) => {
                let change = Box::new(self.components.phase_changed(*change));
                let record = JournalRecord::Phase(change.clone());
                (Outgoing::Phase(change), Some(record))
            }
            Outgoing::Input(input) => {
                self.components.input((*input).clone());
                (Outgoing::Input(input), None)
            }
            other => (other, None),
        };
        let ticket = self.writes.hand_in(record, None, now);
        Some(QueuedEvent { event, ticket })
    }

    /// Everything that is to be written; with the present state, if a new file is to begin.
    pub fn take_writes(
        &mut self,
        new_file: bool,
        now: Instant,
    ) -> (WriteBatch, Option<Vec<JournalRecord>>) {
        let batch = self.writes.take(now);
        // Of what was dropped, only the present state is left.
        let snapshot = new_file || batch.dropped > 0;
        let snapshot = snapshot.then(|| self.components.snapshot());
        (batch, snapshot)
    }
}
