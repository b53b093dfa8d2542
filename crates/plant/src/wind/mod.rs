//! The wind on the tower: mean profile, turbulence spectrum, and the field over all levels.

pub mod field;
mod parameters;
pub mod profile;
pub mod spectrum;

pub use parameters::{BaseSpeed, WindParameters};
