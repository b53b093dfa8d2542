//! Replays recorded inputs through the same diagnosers.
//!
//! A [`Collection`] sorts recorded messages by module. A [`ProcessCourse`] has the inputs of one process of a module in
//! order; [`replay`] feeds them to a diagnoser and compares its verdicts with the recorded ones.
//! [`together`](fn@together) runs all modules on the recorded samples with other settings; a [`ResidualReplay`] computes
//! residuals at every step.

mod collection;
mod columns;
mod comparison;
mod course;
mod cursor;
mod difference;
mod joint;
mod part;
mod player;
mod residuals;
mod samples;
mod settings;
mod shortfall;

pub use collection::{Collection, ModulePosition, ModuleRecord, RecordedStatus};
pub use columns::{RunRows, TableRow};
pub use comparison::ReplayComparison;
pub use course::{ProcessCourse, RecordedState, courses, latest_setup, processes_before};
pub use difference::Difference;
pub use joint::together;
pub use part::{Beginnings, PartError, ReplayPart};
pub use player::{Replayed, ReplayedTransition, corrected, replay};
pub use residuals::ResidualReplay;
pub use samples::{SampleHead, Samples};
pub use settings::ReplaySettings;
pub use shortfall::Shortfall;
