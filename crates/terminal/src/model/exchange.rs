//! What the model wants done, and what comes of it.

use observer::{ModuleHistory, OrderOutcome};
use vocabulary::{Divergences, FaultTransition, FreezeFrame, Identification, Order, OrderKind};

use super::subject::{Subject, Whose};

/// An order about a component.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Given {
    pub(crate) subject: Subject,
    pub(crate) kind: OrderKind,
    pub(crate) order: Order,
}

/// What is to be done outside.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Effect {
    /// Give an order.
    Order(Given),
    /// Ask for the freeze frame of the fault that a component has.
    Frame(Box<FaultTransition>),
    /// Ask what kind of fault it is.
    Identification(Subject),
    /// Ask for the journal of a component's module.
    History(Subject),
    /// Listen to the divergences of this module, and of no other.
    Listen(Option<Whose>),
    /// Give the terminal back until the process is continued.
    Suspend,
    /// End.
    Quit,
}

/// What came of it. Reasons may be foreign texts.
#[derive(Debug, Clone)]
pub(crate) enum Answer {
    Order(Given, OrderOutcome),
    Frame(Subject, Result<Box<FreezeFrame>, String>),
    Identification(Subject, Result<Option<Box<Identification>>, String>),
    History(Subject, Box<ModuleHistory>),
    Divergences(Box<Divergences>),
}
