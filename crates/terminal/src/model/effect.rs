//! Effects that the model requests, and their results.

use observer::{ComponentId, ModuleHistory, ModuleId, OrderOutcome, OrderRequest};
use vocabulary::{Divergences, FaultTransition, FreezeFrame, Identification};

/// An effect to be carried out outside the model.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum ModelEffect {
    /// Send an order.
    Order(OrderRequest),
    /// Request the freeze frame of a component's present fault.
    Frame(Box<FaultTransition>),
    /// Request the kind of a component's fault.
    Identification(ComponentId),
    /// Request the journal of a component's module.
    History(ComponentId),
    /// Subscribe to the divergences of this module only.
    Listen(Option<ModuleId>),
    /// Restore the terminal until the process is continued.
    Suspend,
    /// Quit.
    Quit,
}

/// The result of an effect. Reasons may be texts from other processes.
#[derive(Debug, Clone)]
pub(crate) enum TaskResult {
    Order(OrderRequest, OrderOutcome),
    Frame(ComponentId, Result<Box<FreezeFrame>, String>),
    Identification(ComponentId, Result<Option<Box<Identification>>, String>),
    History(ComponentId, Box<ModuleHistory>),
    Divergences(Box<Divergences>),
}
