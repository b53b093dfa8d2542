//! The state in which nothing moves: structure, actuators, filter and regulator under constant
//! loads.
//!
//! Forces equal demands, F = u = −K x. The structure's elongations are y = y₀ + G F, with y₀ under
//! the loads alone and G the static response of the true structure. The filter stands still when
//! x = x⁺ + L (y − C x⁺) with x⁺ = A x + B F. Inserting one into the other leaves a linear system
//! for x:
//!
//! (I − (I − L C)(A − B K) + L G K) x = L y₀

use nalgebra::{DMatrix, DVector};

use crate::controller::Design;
use crate::error::PlantError;

/// State estimate and forces at rest.
#[derive(Debug, Clone)]
pub(crate) struct Equilibrium {
    pub(crate) state: Vec<f64>,
    pub(crate) forces_n: Vec<f64>,
}

impl Equilibrium {
    /// `response`: G (gages × actuators) \[m/N\]; `elongations`: y₀ (gages) \[m\].
    pub(crate) fn solve(
        design: &Design,
        response: &DMatrix<f64>,
        elongations: &DVector<f64>,
        demand_limit_n: f64,
    ) -> Result<Self, PlantError> {
        let model = &design.model;
        let identity = DMatrix::identity(model.states(), model.states());
        let correction = &identity - &design.filter * &model.gage_map;
        let regulated = model.transition() - &model.force_map * &design.regulator;
        let system =
            &identity - correction * regulated + &design.filter * response * &design.regulator;
        let state =
            system.lu().solve(&(&design.filter * elongations)).ok_or(PlantError::NoEquilibrium)?;
        let forces = -(&design.regulator * &state);
        let largest = forces.amax();
        if !largest.is_finite() {
            return Err(PlantError::NoEquilibrium);
        }
        if largest > demand_limit_n {
            return Err(PlantError::DemandAtStart { demand_n: largest, limit_n: demand_limit_n });
        }
        Ok(Self { state: state.as_slice().to_vec(), forces_n: forces.as_slice().to_vec() })
    }
}
