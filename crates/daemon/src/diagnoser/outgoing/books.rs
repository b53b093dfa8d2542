//! What is known of the components at present: kept by the thread that publishes it, read by the one that replies.

use std::sync::Arc;

use parking_lot::{Mutex, MutexGuard};
use vocabulary::{FaultTransition, Identification, PhaseChange};
use zenoh::key_expr::KeyExpr;

use super::event_lane::Outgoing;
use super::identified_faults::IdentifiedFaults;
use super::states::States;

/// States, identified faults, and the phase.
#[derive(Debug)]
pub(crate) struct Books {
    pub(crate) states: States,
    pub(crate) faults: IdentifiedFaults,
    /// The latest change of phase; none before the first.
    pub(crate) phase: Option<PhaseChange>,
}

impl Books {
    /// The states of the components whose key the expression covers, each with its key.
    pub(super) fn states_at(&self, expression: &KeyExpr<'_>) -> Vec<(String, FaultTransition)> {
        let states = self.states.covered_by(expression).into_iter();
        states.map(|(key, state)| (key.to_owned(), self.faults.completed(state))).collect()
    }

    /// The latest identifications of those components, each with its key.
    pub(super) fn identifications_at(
        &self,
        expression: &KeyExpr<'_>,
    ) -> Vec<(String, Identification)> {
        let found = self.faults.covered_by(expression).into_iter();
        found.map(|(key, found)| (key.to_owned(), found.clone())).collect()
    }

    /// What subscribers will not be told, those who ask get all the same. The disk may not have it yet.
    pub(super) fn enter_lost(&mut self, event: Outgoing) {
        if let Outgoing::Fault(mut transition) = event {
            transition.durable = false;
            self.states.enter(&transition);
        }
    }
}

/// Held only for as long as it takes to read or write them.
#[derive(Debug, Clone)]
pub(crate) struct SharedBooks(Arc<Mutex<Books>>);

impl SharedBooks {
    pub(crate) fn new(books: Books) -> Self {
        Self(Arc::new(Mutex::new(books)))
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Books> {
        self.0.lock()
    }
}
