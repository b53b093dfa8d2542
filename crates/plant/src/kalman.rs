//! The Kalman filter that turns gage readings into modal states.
//!
//! x⁺ = A x + B F, x = x⁺ + L (y − C x⁺), in steady state: L = P Cᵀ (C P Cᵀ + N)⁻¹, P from the
//! Riccati equation with (Aᵀ, Cᵀ) in place of (A, B). F are the *observed* forces of the actuators,
//! by eq. 8 from the measured pressures.
//!
//! Wind is coloured; the filter takes it for white noise of the same power density at the lowest
//! natural frequency, where it shakes most. A level's force is F = ½ ρ c_d A v² in the mean, so
//! gusts of power density S make force gusts of (2 F / v)² S (one-sided; half of it two-sided).

use nalgebra::DMatrix;

use crate::nominal::NominalModel;
use crate::riccati::{self, RiccatiError};

/// The gain L (states × gages) \[1/m\].
///
/// `disturbance_power`: two-sided power density of each disturbance \[N²/Hz\];
/// `gage_variances`: of each gage's noise \[m²\].
pub(crate) fn design(
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
