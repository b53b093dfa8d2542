//! Events, as modules and processes publish them.

use serde::{Deserialize, Serialize};
use vocabulary::{FaultTransition, Identification, ModuleName, PhaseChange, StructureName};

use super::component::is_noteworthy;

/// An event.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "news", rename_all = "snake_case")]
pub enum News {
    /// A verdict changed. Verdicts of a module are handed out once each, in the order of their sequence numbers.
    Fault(Box<FaultTransition>),
    /// The state of a component when its module was first heard, by the reply to a query: it may have been so long before.
    Present(Box<FaultTransition>),
    /// The kind of a component's fault was identified.
    Identification(Box<Identification>),
    /// A module entered another phase.
    Phase(PhaseChange),
    /// A process appeared or disappeared.
    Presence {
        /// The structure.
        structure: StructureName,
        /// The module, or `plant`.
        who: String,
        /// Whether it appeared.
        there: bool,
        /// Whether it was found when the observer connected: it may have appeared long before.
        at_start: bool,
    },
    /// A diagnoser reports another process that runs as the same module.
    SeveralProcesses {
        /// The structure.
        structure: StructureName,
        /// The module.
        module: ModuleName,
    },
    /// Transitions of a module were missed and could not be fetched from its journal. They may still arrive unless a
    /// later one has been handed out.
    Missed {
        /// The structure.
        structure: StructureName,
        /// The module.
        module: ModuleName,
        /// The sequence number of the first.
        from: u64,
        /// The sequence number of the last.
        to: u64,
        /// Why they could not be fetched.
        reason: String,
    },
    /// A message could not be read.
    Unreadable {
        /// Its key.
        key: String,
        /// What is wrong with it.
        problem: String,
    },
    /// The observer itself lost its connection, or has one again. Meanwhile it can say nothing of any module.
    Connection {
        /// Whether it is connected.
        connected: bool,
    },
    /// Events were lost because the queue was full.
    Lost {
        /// How many.
        count: u64,
    },
}

impl News {
    /// Whether it has a line in lists of events. Of what was so before, only alarms do, shelved and suppressed ones included.
    #[must_use]
    pub fn is_shown(&self) -> bool {
        !matches!(self, Self::Present(state) if !is_noteworthy(state))
    }
}

/// An event with a number.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservedEvent {
    /// Its number: each observer counts those with a line in lists from 1, so that a missing number is a lost event. One
    /// without a line has the number of the latest that has one.
    pub number: u64,
    /// When it arrived, by the local clock \[ns since 1970\].
    pub time_unix_ns: u64,
    /// The event.
    pub news: News,
}
