//! The terminal view: what operators look at without a browser.
//!
//! | module | what |
//! |---|---|
//! | `model` | what is shown and what is typed: a plain value, events in and effects out |
//! | `view` | the model drawn into a buffer of cells |
//! | `station` | keyboard, screen, signals, questions to modules: everything that waits |
//! | `settings` | where it looks, and who gives orders |

mod model;
#[cfg(test)]
mod screens;
mod settings;
mod station;
#[cfg(test)]
mod testing;
mod view;

pub use settings::{OrderIssuer, ViewSettings};
pub use station::{ViewError, run};
pub use view::Plot;
