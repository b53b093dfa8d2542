//! The true structure with its loads, before actuators, sensors and controller are added.

use nalgebra::{DMatrix, DVector};
use truss::{Direction, Level, Mechanics, Structure};

use crate::controller::beside;
use crate::course::SlowClock;
use crate::error::PlantError;
use crate::live_loads::LiveLoads;
use crate::loads::{
    add_live_masses, draw_live_loads, heights_above_ground, level_map, loaded_levels,
};
use crate::nodal_loads::NodalLoads;
use crate::parameters::PlantParameters;
use crate::slow_elongations::{Changing, SlowElongations};
use crate::temperature::Temperature;
use crate::wind_loads::{WindConditions, WindLoads};

/// The true structure with its loads, before actuators, sensors and controller are added.
pub(crate) struct Tower {
    pub(crate) mechanics: Mechanics,
    levels: Vec<Level>,
    pub(crate) wind: WindLoads,
    pub(crate) nodal_loads: NodalLoads,
    /// Live load of each level that can move, from the bottom up \[kg\].
    pub(crate) live_loads_kg: Vec<f64>,
}

impl Tower {
    pub(crate) fn new(
        truth: &Structure,
        parameters: &PlantParameters,
        wind: WindConditions,
        nodal_loads: NodalLoads,
        seed: u64,
    ) -> Result<Self, PlantError> {
        let mut mechanics = Mechanics::assemble(truth)?;
        let levels = loaded_levels(truth);
        let live_loads_kg = draw_live_loads(&parameters.loads, levels.len(), seed);
        add_live_masses(&mut mechanics, &levels, &live_loads_kg);
        let heights = heights_above_ground(truth, &levels);
        let wind = WindLoads::new(
            &parameters.wind,
            &parameters.loads,
            wind,
            &heights,
            parameters.step_s,
            seed,
        );
        Ok(Self { mechanics, levels, wind, nodal_loads, live_loads_kg })
    }

    /// Nodal forces per wind force (dofs × 2 levels).
    pub(crate) fn wind_map(&self) -> DMatrix<f64> {
        let map = |direction| level_map(&self.mechanics, &self.levels, direction);
        beside(&map(Direction::X), &map(Direction::Y))
    }

    /// Elongations per nodal force (gages × columns of `nodal_forces`), in equilibrium.
    pub(crate) fn elongations(
        &self,
        nodal_forces: &DMatrix<f64>,
    ) -> Result<DMatrix<f64>, PlantError> {
        Ok(&self.mechanics.gage_map * self.mechanics.static_displacements(nodal_forces)?)
    }

    pub(crate) fn live_elongations(&self, gravity: f64) -> Result<DVector<f64>, PlantError> {
        let weights = self.live_loads_kg.iter().map(|mass| -gravity * mass);
        let weights = DVector::from_iterator(self.levels.len(), weights);
        let forces = level_map(&self.mechanics, &self.levels, Direction::Z) * weights;
        let elongations = self.elongations(&DMatrix::from_columns(&[forces]))?;
        Ok(elongations.column(0).into_owned())
    }

    /// The effect of live loads and temperature on the gages, both of which may change.
    pub(crate) fn slow_elongations(
        &self,
        truth: &Structure,
        parameters: &PlantParameters,
        seed: u64,
    ) -> Result<SlowElongations, PlantError> {
        let (loads, temperature) = (&parameters.loads, &parameters.temperature);
        let at_start = self.live_elongations(loads.gravity_m_per_s2)?.as_slice().to_vec();
        if loads.live_load_changes_per_hour == 0.0 && temperature.is_even() {
            return Ok(SlowElongations::new(at_start, None));
        }
        let weights = level_map(&self.mechanics, &self.levels, Direction::Z);
        let per_kg = self.elongations(&weights)? * -loads.gravity_m_per_s2;
        let per_strain = self.mechanics.strain_response(truth)?;
        let changing = Changing {
            loads: LiveLoads::new(&self.live_loads_kg, per_kg, loads, seed),
            temperature: Temperature::new(truth, &per_strain, temperature, seed),
            clock: SlowClock::new(parameters.step_s),
        };
        Ok(SlowElongations::new(at_start, Some(changing)))
    }
}
