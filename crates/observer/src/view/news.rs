//! What happens, as it is published.

use serde::Serialize;
use vocabulary::{FaultTransition, Identification, ModuleName, PhaseChange, StructureName};

/// Something that happened.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "news", rename_all = "snake_case")]
pub enum News {
    /// A verdict changed. Those of a module come in the order of their numbers, each once.
    Fault(Box<FaultTransition>),
    /// What kind of fault a component has turned out to have.
    Identification(Box<Identification>),
    /// A module entered another phase.
    Phase(PhaseChange),
    /// A process came or went.
    Presence {
        /// The structure.
        structure: StructureName,
        /// The module, or `plant`.
        who: String,
        /// Came, or went.
        there: bool,
    },
    /// A diagnoser knows of another process that runs as the same module.
    SeveralProcesses {
        /// The structure.
        structure: StructureName,
        /// The module.
        module: ModuleName,
    },
    /// Transitions of a module were missed and could not be fetched from its journal. They may still come unless a later
    /// one has.
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
    /// Events were lost because they were not taken in time.
    Lost {
        /// How many.
        count: u64,
    },
}

/// Something that happened, with a number that counts the events of one observer from 1.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservedEvent {
    /// Its number.
    pub number: u64,
    /// When it came, by the clock here \[ns since 1970\].
    pub time_unix_ns: u64,
    /// What happened.
    pub news: News,
}
