//! The true structure with its loads, before anything acts on it.

use nalgebra::{DMatrix, DVector};
use truss::{Direction, Level, Mechanics, Structure};

use crate::controller::beside;
use crate::error::PlantError;
use crate::loads::{
    add_live_masses, draw_live_loads, heights_above_ground, level_map, loaded_levels,
};
use crate::parameters::PlantParameters;
use crate::wind_loads::{WindConditions, WindLoads};

/// What was drawn for a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Conditions {
    /// Largest base wind speed of the run \[m/s\].
    pub base_speed_m_per_s: f64,
    /// Where the wind blows to, from the x axis towards y \[rad\].
    pub wind_direction_rad: f64,
    /// Live load of each level above the lowest, from the bottom up \[kg\].
    pub live_loads_kg: Vec<f64>,
}

/// The true structure with its loads, before anything stands on it.
pub(crate) struct Tower {
    pub(crate) mechanics: Mechanics,
    levels: Vec<Level>,
    pub(crate) wind: WindLoads,
    pub(crate) conditions: Conditions,
}

impl Tower {
    pub(crate) fn new(
        truth: &Structure,
        parameters: &PlantParameters,
        seed: u64,
    ) -> Result<Self, PlantError> {
        let mut mechanics = Mechanics::assemble(truth)?;
        let levels = loaded_levels(truth);
        let live_loads_kg = draw_live_loads(&parameters.loads, levels.len(), seed);
        add_live_masses(&mut mechanics, &levels, &live_loads_kg);
        let drawn = WindConditions::draw(&parameters.wind, seed);
        let conditions = Conditions {
            base_speed_m_per_s: drawn.speed.largest(),
            wind_direction_rad: drawn.direction_rad,
            live_loads_kg,
        };
        let heights = heights_above_ground(truth, &levels);
        let wind = WindLoads::new(
            &parameters.wind,
            &parameters.loads,
            drawn,
            &heights,
            parameters.step_s,
            seed,
        );
        Ok(Self { mechanics, levels, wind, conditions })
    }

    /// Nodal forces per wind force (dofs × 2 levels).
    pub(crate) fn wind_map(&self) -> DMatrix<f64> {
        let map = |direction| level_map(&self.mechanics, &self.levels, direction);
        beside(&map(Direction::X), &map(Direction::Y))
    }

    /// Elongations per nodal force (gages × columns of `nodal_forces`), at rest.
    pub(crate) fn elongations(
        &self,
        nodal_forces: &DMatrix<f64>,
    ) -> Result<DMatrix<f64>, PlantError> {
        Ok(&self.mechanics.gage_map * self.mechanics.static_displacements(nodal_forces)?)
    }

    pub(crate) fn live_elongations(&self, gravity: f64) -> Result<DVector<f64>, PlantError> {
        let weights = self.conditions.live_loads_kg.iter().map(|mass| -gravity * mass);
        let weights = DVector::from_iterator(self.levels.len(), weights);
        let forces = level_map(&self.mechanics, &self.levels, Direction::Z) * weights;
        let elongations = self.elongations(&DMatrix::from_columns(&[forces]))?;
        Ok(elongations.column(0).into_owned())
    }
}
