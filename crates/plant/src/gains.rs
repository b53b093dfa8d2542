//! The gains of the controller: a linear-quadratic regulator and a Kalman filter, each from a Riccati equation.

use nalgebra::DMatrix;

use crate::nominal::NominalModel;
use crate::riccati::{self, RiccatiError};

/// The linear-quadratic regulator: demands u = −K x that minimise Σ xᵀQx + uᵀRu.
///
/// In the states (ω η, η̇) the weight Q = diag(ω², 1) of (η, η̇) is the identity: twice the energy
/// of the modes. R = r·I.
///
/// The gain K (actuators × states) \[N\].
pub(crate) fn regulator(
    model: &NominalModel,
    effort_weight: f64,
) -> Result<DMatrix<f64>, RiccatiError> {
    let (states, actuators) = (model.states(), model.force_map.ncols());
    if states == 0 || actuators == 0 {
        return Ok(DMatrix::zeros(actuators, states));
    }
    let transition = model.transition();
    let state_weight = DMatrix::identity(states, states);
    let input_weight = DMatrix::identity(actuators, actuators) * effort_weight;
    let cost =
        riccati::solve_discrete(&transition, &model.force_map, &state_weight, &input_weight)?;
    riccati::gain(&transition, &model.force_map, &input_weight, &cost)
}

/// The Kalman filter that turns gage readings into modal states.
///
/// x⁺ = A x + B F, x = x⁺ + L (y − C x⁺), in steady state: L = P Cᵀ (C P Cᵀ + N)⁻¹, P from the
/// Riccati equation with (Aᵀ, Cᵀ) in place of (A, B). F are the *observed* forces of the actuators,
/// by eq. 8 from the measured pressures.
///
/// The wind is coloured; the filter treats it as white noise of the same power density at the lowest natural frequency,
/// where it excites most. A level's mean force is F = ½ ρ c_d A v², so gusts of power density S cause force gusts of
/// (2 F / v)² S (one-sided; half of it two-sided).
///
/// The gain L (states × gages) \[1/m\].
///
/// `disturbance_power`: two-sided power density of each disturbance \[N²/Hz\];
/// `gage_variances`: of each gage's noise \[m²\].
pub(crate) fn filter(
    model: &NominalModel,
    disturbance_power: &[f64],
    gage_variances: &[f64],
    step_s: f64,
) -> Result<DMatrix<f64>, RiccatiError> {
    let gages = gage_variances.len();
    if model.states() == 0 || gages == 0 {
        return Ok(DMatrix::zeros(model.states(), gages));
    }
    // White noise held over a step has the variance (density / step).
    let map = &model.disturbance_map;
    let process = map * diagonal(disturbance_power) * map.transpose() / step_s;
    let noise = diagonal(gage_variances);
    let transition = model.transition().transpose();
    let outputs = model.gage_map.transpose();
    let predicted = riccati::solve_discrete(&transition, &outputs, &process, &noise)?;
    // The gain of the dual regulator with an identity transition is Lᵀ.
    let identity = DMatrix::identity(model.states(), model.states());
    Ok(riccati::gain(&identity, &outputs, &noise, &predicted)?.transpose())
}

fn diagonal(values: &[f64]) -> DMatrix<f64> {
    DMatrix::from_diagonal(&nalgebra::DVector::from_column_slice(values))
}
