//! What the comparison with the reference says of each component, for the thread that answers queries: written by the
//! diagnosis loop.

use std::sync::Arc;

use parking_lot::Mutex;
use shell::clock;
use vocabulary::{Condition, FaultTransition, Unknown};

/// Shared by the loop and those who answer.
#[derive(Debug, Clone)]
pub(crate) struct Conditions(Arc<Mutex<Vec<Known>>>);

#[derive(Debug, Clone)]
struct Known {
    condition: Condition,
    /// Since when the component may not be called normal.
    hidden_since_ns: Option<u64>,
}

impl Conditions {
    pub(crate) fn new<'a>(conditions: impl Iterator<Item = &'a Condition>) -> Self {
        let known =
            |condition: &Condition| Known { condition: condition.clone(), hidden_since_ns: None };
        let board = Self(Arc::new(Mutex::new(conditions.map(known).collect())));
        board.0.lock().iter_mut().for_each(Known::date);
        board
    }

    /// Takes the conditions at present, in the order of the channels.
    pub(crate) fn update<'a>(&self, conditions: impl Iterator<Item = &'a Condition>) {
        let mut board = self.0.lock();
        for (known, condition) in board.iter_mut().zip(conditions) {
            known.condition.clone_from(condition);
            known.date();
        }
    }

    /// A component's state with its condition. What cannot be verified is not normal.
    pub(crate) fn enter(&self, channel: usize, state: FaultTransition) -> FaultTransition {
        let board = self.0.lock();
        let Some(known) = board.get(channel) else { return state };
        let condition = known.condition.clone();
        let reason = condition.reason().unwrap_or_default();
        let state = match known.hidden_since_ns {
            Some(since_unix_ns) if state.state() == vocabulary::FaultState::Normal => {
                state.while_unknown(Unknown { since_unix_ns, reason })
            }
            _ => state,
        };
        FaultTransition { condition: Some(condition), ..state }
    }
}

impl Known {
    /// What lasts began when it was first seen.
    fn date(&mut self) {
        let hidden = !self.condition.allows_normal();
        let since = self.hidden_since_ns.unwrap_or_else(clock::unix_ns);
        self.hidden_since_ns = hidden.then_some(since);
    }
}
