//! Why a plant cannot be created.

use crate::check::ParameterErrors;
use crate::riccati::RiccatiError;
use vocabulary::NodeName;

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
    /// A load on nodes that do not fit the structure.
    #[error("`{place}` names the node `{node}`, {problem}")]
    LoadNode {
        /// The parameter, with the number of the load, from 0.
        place: String,
        /// The node.
        node: NodeName,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// Controller and structure have no common equilibrium.
    #[error(
        "the closed loop has no equilibrium under the loads at the start; use another controller weight"
    )]
    NoEquilibrium,
    /// The loads at the start alone require more force than the actuators may exert.
    #[error(
        "mean wind and live loads at the start ask for {demand_n:.0} N, above the limit of {limit_n:.0} N; use smaller ones or a higher `hydraulics.demand_limit_n`"
    )]
    DemandAtStart {
        /// Largest demand in equilibrium \[N\].
        demand_n: f64,
        /// Largest demand permitted \[N\].
        limit_n: f64,
    },
}
