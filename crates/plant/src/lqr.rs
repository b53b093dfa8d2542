//! The linear-quadratic regulator: demands u = −K x that least cost Σ xᵀQx + uᵀRu.
//!
//! In the states (ω η, η̇) the weight Q = diag(ω², 1) of (η, η̇) is the identity: twice the energy
//! of the modes. R = r·I.

use nalgebra::DMatrix;

use crate::nominal::NominalModel;
use crate::riccati::{self, RiccatiError};

/// The gain K (actuators × states) \[N\].
pub(crate) fn design(
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
