//! The controller's nominal model of the structure: its lowest modes in discrete time.
//!
//! The state of a mode is (ω η, η̇), with η the mass-normalised modal displacement, so its square is
//! twice the mode's energy. Per mode: ẋ₁ = ω x₂, ẋ₂ = −ω x₁ − 2 ζ ω x₂ + f, with f the modal force,
//! discretised exactly for f constant over a step.

use nalgebra::{DMatrix, Matrix3};
use truss::{Mechanics, Modes};

/// The lowest modes, discretised.
#[derive(Debug, Clone)]
pub(crate) struct NominalModel {
    /// Transition of each mode's state over a step.
    pub(crate) transitions: Vec<[[f64; 2]; 2]>,
    /// State per force held over a step (2 modes × actuators) \[1/N\].
    pub(crate) force_map: DMatrix<f64>,
    /// State per level force held over a step (2 modes × inputs) \[1/N\].
    pub(crate) disturbance_map: DMatrix<f64>,
    /// Elongation per state (gages × 2 modes) \[m\].
    pub(crate) gage_map: DMatrix<f64>,
    /// Modal force of each actuator over the mode's ω (modes × actuators): the square of its product with forces is twice the
    /// elastic energy under them.
    pub(crate) energy_map: DMatrix<f64>,
}

impl NominalModel {
    /// `disturbance_map`: nodal forces per disturbance (dofs × inputs).
    pub(crate) fn new(
        mechanics: &Mechanics,
        modes: &Modes,
        disturbance_map: &DMatrix<f64>,
        step_s: f64,
    ) -> Self {
        let count = modes.angular_frequencies.len();
        let mut transitions = Vec::with_capacity(count);
        // State per unit of modal force.
        let mut force_to_state = DMatrix::zeros(2 * count, count);
        let mut state_to_displacement = DMatrix::zeros(count, 2 * count);
        let damping = modes.damping_ratios.iter();
        for (mode, (&omega, &ratio)) in modes.angular_frequencies.iter().zip(damping).enumerate() {
            let [[a, b], [c, d]] = [[0.0, omega], [-omega, -2.0 * ratio * omega]];
            let held = (Matrix3::new(a, b, 0.0, c, d, 1.0, 0.0, 0.0, 0.0) * step_s).exp();
            transitions.push([[held[(0, 0)], held[(0, 1)]], [held[(1, 0)], held[(1, 1)]]]);
            force_to_state[(2 * mode, mode)] = held[(0, 2)];
            force_to_state[(2 * mode + 1, mode)] = held[(1, 2)];
            state_to_displacement[(mode, 2 * mode)] = 1.0 / omega;
        }
        let state_per_nodal_force = force_to_state * modes.shapes.transpose();
        let mut energy_map = modes.shapes.transpose() * &mechanics.actuator_map;
        for (mut row, omega) in energy_map.row_iter_mut().zip(&modes.angular_frequencies) {
            row /= *omega;
        }
        Self {
            energy_map,
            transitions,
            force_map: &state_per_nodal_force * &mechanics.actuator_map,
            disturbance_map: state_per_nodal_force * disturbance_map,
            gage_map: &mechanics.gage_map * &modes.shapes * state_to_displacement,
        }
    }

    pub(crate) fn states(&self) -> usize {
        2 * self.transitions.len()
    }

    /// The transition of all modes as one matrix (2 modes × 2 modes).
    pub(crate) fn transition(&self) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(self.states(), self.states());
        for (mode, block) in self.transitions.iter().enumerate() {
            for (row, values) in block.iter().enumerate() {
                for (column, value) in values.iter().enumerate() {
                    matrix[(2 * mode + row, 2 * mode + column)] = *value;
                }
            }
        }
        matrix
    }
}
