//! What goes out. `Q` is the query that a reply goes to.

use vocabulary::{
    Capability, ChangeReport, Corrected, Divergences, FaultTransition, Identification, Input,
    ModuleStatus, Obeyed, PhaseChange, Progress, StateAnswer,
};

/// Something that must not be lost.
#[derive(Debug)]
pub enum Outgoing<Q> {
    /// A transition of the verdict on a component.
    Fault(Box<FaultTransition>),
    /// What was found of a fault. It is stored and published if it is news.
    Identification(Box<Identification>),
    /// A change.
    Change(Box<ChangeReport>),
    /// Another phase.
    Phase(Box<PhaseChange>),
    /// An order was obeyed by a transition before this.
    Obeyed {
        /// The order.
        query: Q,
        /// The reply.
        obeyed: Obeyed,
    },
    /// What the diagnoser took beside samples: before everything that comes of it.
    Input(Box<Input>),
}

impl<Q> Outgoing<Q> {
    /// Says in the message whether the disk has it.
    pub fn set_durable(&mut self, durable: bool) {
        match self {
            Outgoing::Fault(transition) => transition.durable = durable,
            Outgoing::Obeyed { obeyed, .. } => obeyed.durable = durable,
            _ => {}
        }
    }
}

/// An event that is in the store.
#[derive(Debug)]
pub struct QueuedEvent<Q> {
    /// The event.
    pub event: Outgoing<Q>,
    /// To wait for the disk with.
    pub ticket: u64,
}

/// Something that is superseded soon, or asked for again.
#[derive(Debug)]
pub enum Routine<Q> {
    /// Divergences.
    Divergences(Divergences),
    /// Corrected readings.
    Corrected(Corrected),
    /// What cylinders can do.
    Capability(Capability),
    /// Status.
    Status(Box<ModuleStatus>),
    /// Progress.
    Progress(Progress),
    /// The answer to a peer's question.
    Answer {
        /// The question.
        query: Q,
        /// The answer.
        answer: StateAnswer,
    },
    /// No answer.
    Refusal {
        /// The question.
        query: Q,
        /// Why.
        reason: String,
    },
}
