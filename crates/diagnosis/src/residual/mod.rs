//! Residuals: what is measured less what the module's own models say (section 4.1 of the paper).

mod force_loop;
mod generator;
mod hydraulics;

pub use force_loop::ForceLoop;
pub use generator::{ActuatorResidual, ResidualGenerator};
pub use hydraulics::{Hydraulics, HydraulicsError};
