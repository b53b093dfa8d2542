//! The study's figures: those of the paper, power curves, limits, and motions.

mod identification;
mod limits;
mod paper;
mod power;
mod rivals;
mod tolerance;

pub use identification::identification_figure;
pub use limits::limits_figure;
pub use paper::{figure4, figure5, figure6};
pub use power::power_figure;
pub use rivals::rivals_figure;
pub use tolerance::tolerance_figure;
