//! Residuals: what is measured less what the module's own models say (section 4.1 of the paper).

mod force_loop;
mod generator;
mod nominal_hydraulics;
mod tracked_force;

pub use force_loop::ForceLoop;
pub(crate) use generator::longest_gap_of_loops;
pub use generator::{ActuatorResidual, ResidualGenerator, longest_gap_of_structure};
pub use nominal_hydraulics::{HydraulicsError, NominalHydraulics};
