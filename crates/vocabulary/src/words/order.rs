//! Outcomes of orders.

use crate::OrderKind;

/// Why nobody takes an order to a module that is there.
pub const UNTAKEN: &str = "nobody takes the command: its diagnoser has just ended, or access control does not admit the \
                           command";

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
    }
}

/// That an order to a module was obeyed, and its journal has not got it.
#[must_use]
pub fn not_saved(module: &str) -> String {
    format!(
        "carried out, but not saved: the disk of `{module}` is full or does not answer, and a restart may forget it; \
         see `trusswatch health`, and repeat the command when the disk is well"
    )
}

/// That an order was sent and nothing came back, for this reason.
#[must_use]
pub fn perhaps(reason: &str) -> String {
    format!("{reason}; the command may or may not have been carried out")
}
