//! The terminal view, for operators without a browser.
//!
//! | module | what |
//! |---|---|
//! | `model` | the state of the view as a plain value, events in and effects out |
//! | `view` | draws the model into a buffer of cells |
//! | `station` | keyboard, screen, signals and queries to modules: everything that blocks |
//! | `settings` | what to observe, and who issues orders |

mod model;
#[cfg(test)]
mod screens_test;
mod settings;
mod station;
#[cfg(test)]
mod testing;
mod view;

pub use settings::{OrderIssuer, ViewSettings};
pub use station::{ViewError, run};
pub use view::Plot;
