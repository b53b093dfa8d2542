//! Many diagnosers on one machine: what each takes of it, and how long a verdict takes.
//!
//! | file | job |
//! |---|---|
//! | `row` | processes of a row of towers, as `trusswatch replicate` lays it out |
//! | `plan` | how long what is measured, and which faults are injected when |
//! | `figures` | runs a row and measures |
//! | `table` | the figures, row by row |

mod figures;
mod plan;
mod row;
mod table;

pub use figures::{Figures, measure};
pub use plan::Plan;
pub use row::{Row, Setting, Topology};
pub use table::Table;
