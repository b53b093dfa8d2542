//! Levels: their exposure to wind, and live loads unknown to the controller.
//!
//! A level is a distinct height at which any node can move. Its live load adds mass and weight.

use nalgebra::DMatrix;
use rand::RngExt;
use serde::{Deserialize, Serialize};
use truss::{Direction, Level, Mechanics, Structure};

use crate::check::Checks;
use crate::streams::Stream;

/// Wind exposure and live loads of the levels. Marks: \[E\] engineering estimate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LoadParameters {
    /// Drag coefficient c_d \[–\]: 1.3 \[E\].
    pub drag_coefficient: f64,
    /// Exposed area of each level \[m²\]: 14.25, a storey of 3 m times 4.75 m \[E\].
    pub area_per_level_m2: f64,
    /// The live load of each level is drawn from U(0, this) \[kg\]: 1000 \[E\].
    pub live_load_max_kg: f64,
    /// Rate at which the live load of some level changes to another value in that range \[1/h\]: 0.
    pub live_load_changes_per_hour: f64,
    /// Duration of such a change \[s\]: 20 \[E\].
    pub live_load_ramp_s: f64,
    /// Acceleration of gravity \[m/s²\]: 9.81.
    pub gravity_m_per_s2: f64,
}

impl Default for LoadParameters {
    fn default() -> Self {
        Self {
            drag_coefficient: 1.3,
            area_per_level_m2: 14.25,
            live_load_max_kg: 1000.0,
            live_load_changes_per_hour: 0.0,
            live_load_ramp_s: 20.0,
            gravity_m_per_s2: 9.81,
        }
    }
}

impl LoadParameters {
    pub(crate) fn check(&self, checks: &mut Checks) {
        checks.within("loads.drag_coefficient", self.drag_coefficient, 0.0..=1e3, "");
        checks.within("loads.area_per_level_m2", self.area_per_level_m2, 0.0..=1e6, "m²");
        checks.within("loads.live_load_max_kg", self.live_load_max_kg, 0.0..=1e9, "kg");
        let rate = self.live_load_changes_per_hour;
        checks.within("loads.live_load_changes_per_hour", rate, 0.0..=1e6, "1/h");
        checks.within("loads.live_load_ramp_s", self.live_load_ramp_s, 1e-6..=1e6, "s");
        checks.within("loads.gravity_m_per_s2", self.gravity_m_per_s2, 0.0..=1e3, "m/s²");
    }
}

/// The levels with a node that can move, from the bottom up: without the base of a tower, with the deck of a bridge.
pub(crate) fn loaded_levels(structure: &Structure) -> Vec<Level> {
    let moves = |&node: &usize| {
        let support = structure.nodes[node].support;
        [Direction::X, Direction::Y, Direction::Z].iter().any(|axis| !support.holds(*axis))
    };
    structure.levels().into_iter().filter(|level| level.nodes.iter().any(moves)).collect()
}

/// Heights of levels above the lowest nodes of the structure \[m\].
pub(crate) fn heights_above_ground(structure: &Structure, levels: &[Level]) -> Vec<f64> {
    let ground = structure.levels().first().map_or(0.0, |level| level.height_m);
    levels.iter().map(|level| level.height_m - ground).collect()
}

/// Nodal forces per level force (dofs × levels); each level's force is shared equally by its nodes.
pub(crate) fn level_map(
    mechanics: &Mechanics,
    levels: &[Level],
    direction: Direction,
) -> DMatrix<f64> {
    let mut map = DMatrix::zeros(mechanics.dofs.len(), levels.len());
    for (column, level) in levels.iter().enumerate() {
        let share = 1.0 / level.nodes.len() as f64;
        for &node in &level.nodes {
            if let Some(dof) = mechanics.dof_index(node, direction) {
                map[(dof, column)] = share;
            }
        }
    }
    map
}

/// Draws the live load of each level \[kg\].
pub(crate) fn draw_live_loads(loads: &LoadParameters, levels: usize, seed: u64) -> Vec<f64> {
    let mut generator = Stream::LiveLoads.generator(seed);
    (0..levels).map(|_| loads.live_load_max_kg * generator.random::<f64>()).collect()
}

/// Adds live loads \[kg\] to the masses of the levels' nodes.
pub(crate) fn add_live_masses(mechanics: &mut Mechanics, levels: &[Level], live_loads_kg: &[f64]) {
    for (level, live_load) in levels.iter().zip(live_loads_kg) {
        let share = live_load / level.nodes.len() as f64;
        for (dof, mass) in mechanics.dofs.iter().zip(mechanics.mass.iter_mut()) {
            if level.nodes.contains(&dof.node) {
                *mass += share;
            }
        }
    }
}
