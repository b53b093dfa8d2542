//! Residuals: what is measured less what the module's own models say (section 4.1 of the paper).

mod force_loop;
mod generator;
mod nominal_hydraulics;

pub use force_loop::ForceLoop;
pub use generator::{ActuatorResidual, ResidualGenerator};
pub use nominal_hydraulics::{HydraulicsError, NominalHydraulics};
