//! Why a plant cannot be created.

use crate::check::ParameterErrors;
use crate::riccati::RiccatiError;

/// Why a plant cannot be created.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// Parameters out of range.
    #[error(transparent)]
    Parameters(#[from] ParameterErrors),
    /// The structure does not yield a valid model.
    #[error(transparent)]
    Model(#[from] truss::ModelError),
    /// No controller exists for the structure and the weights.
    #[error("no controller can be designed: {0}")]
    Controller(#[from] RiccatiError),
    /// The structure on which the controller was designed has different actuators or gages.
    #[error(
        "the true structure and the nominal one differ in their equipment: {0}; use the same actuators and gages in the same order"
    )]
    Equipment(String),
    /// Controller and structure have no common equilibrium.
    #[error("the closed loop has no equilibrium under mean wind; use another controller weight")]
    NoEquilibrium,
    /// The mean wind alone requires more force than the actuators may exert.
    #[error(
        "the mean wind at the start asks for {demand_n:.0} N, above the limit of {limit_n:.0} N; use less wind or a higher `hydraulics.demand_limit_n`"
    )]
    DemandAtStart {
        /// Largest demand in equilibrium \[N\].
        demand_n: f64,
        /// Largest demand permitted \[N\].
        limit_n: f64,
    },
}
