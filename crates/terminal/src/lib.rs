//! The terminal view, for operators without a browser.
//!
//! | module | what |
//! |---|---|
//! | `model` | the state of the view as a plain value, events in and effects out |
//! | `view` | draws the model into a buffer of cells |
//! | `station` | keyboard, screen, signals and queries to modules: everything that blocks |

mod model;
#[cfg(test)]
mod screens_test;
mod station;
#[cfg(test)]
mod testing;
mod view;

pub use station::{ViewError, run};
pub use view::Plot;

use std::time::Duration;

use vocabulary::{ModuleName, OperatorName, StructureName};

/// Settings of the view.
#[derive(Debug, Clone)]
pub struct ViewSettings {
    /// A name for the observed places.
    pub places: String,
    /// The structure to show; otherwise all observed structures.
    pub structure: Option<StructureName>,
    /// Modules that should be running.
    pub expected: Vec<ModuleName>,
    /// Timeout of each answer.
    pub timeout: Duration,
    /// Who issues orders, or why none may be issued.
    pub issuer: Result<OrderIssuer, String>,
    /// Whether colours are shown beside symbols and words.
    pub colours: bool,
    /// Whether the terminal has no UTF-8: symbols and foreign letters are shown in ASCII.
    pub ascii: bool,
}

/// The issuer of orders.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OrderIssuer {
    /// The name recorded in the journal.
    pub by: String,
    /// The operator in the session's certificate, if it belongs to an operator.
    pub operator: Option<OperatorName>,
}
