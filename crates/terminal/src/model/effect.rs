//! What the model wants done outside, and the results.

use observer::{ComponentId, ModuleHistory, ModuleId, OrderOutcome, OrderRequest};
use vocabulary::{Divergences, FaultTransition, FreezeFrame, Identification};

/// What is to be done outside.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum ModelEffect {
    /// Give an order.
    Order(OrderRequest),
    /// Ask for the freeze frame of the fault that a component has.
    Frame(Box<FaultTransition>),
    /// Ask what kind of fault it is.
    Identification(ComponentId),
    /// Ask for the journal of a component's module.
    History(ComponentId),
    /// Listen to the divergences of this module, and of no other.
    Listen(Option<ModuleId>),
    /// Give the terminal back until the process is continued.
    Suspend,
    /// End.
    Quit,
}

/// What came of it. Reasons may be foreign texts.
#[derive(Debug, Clone)]
pub(crate) enum TaskResult {
    Order(OrderRequest, OrderOutcome),
    Frame(ComponentId, Result<Box<FreezeFrame>, String>),
    Identification(ComponentId, Result<Option<Box<Identification>>, String>),
    History(ComponentId, Box<ModuleHistory>),
    Divergences(Box<Divergences>),
}
