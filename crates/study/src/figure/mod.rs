//! The study's figures: those of the paper, power curves, and limits.

mod identification;
mod limits;
mod paper;
mod power;

pub use identification::identification_figure;
pub use limits::limits_figure;
pub use paper::{figure4, figure5, figure6};
pub use power::power_figure;
