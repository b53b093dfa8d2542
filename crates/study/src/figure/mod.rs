//! The study's figures: those of the paper, and power curves.

mod paper;
mod power;

pub use paper::{figure4, figure5, figure6};
pub use power::power_figure;
