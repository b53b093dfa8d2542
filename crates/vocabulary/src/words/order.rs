//! Outcomes of orders.

use crate::OrderKind;

/// Why a running module did not accept an order.
pub const UNTAKEN: &str =
    "no diagnoser accepted the command (stopped, or denied by access control)";

/// What was done when an order was obeyed, e.g. `acknowledged`.
#[must_use]
pub fn done(order: OrderKind) -> &'static str {
    match order {
        OrderKind::Acknowledge => "acknowledged",
        OrderKind::Reset => "reset",
        OrderKind::Shelve => "shelved",
        OrderKind::Unshelve => "unshelved",
        OrderKind::Suppress => "suppressed",
        OrderKind::Unsuppress => "no longer suppressed",
        OrderKind::ShutOff => "shut off",
        OrderKind::PutBack => "put back",
        OrderKind::Declare => "declared faulty",
    }
}

/// A module carried out an order but could not save it in its journal.
#[must_use]
pub fn not_saved(module: &str) -> String {
    format!(
        "carried out but not saved: the disk of `{module}` is full or not responding; a restart may lose it; \
         check with `trusswatch health`, then repeat the command"
    )
}

/// That an order was sent and nothing came back, for this reason.
#[must_use]
pub fn perhaps(reason: &str) -> String {
    format!("{reason}; the command may or may not have been carried out")
}
