//! What can go wrong in a study.

use plant::{ParameterErrors, PlantError};

use crate::rig::RigError;

/// A study that cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The plant.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// Parameters of the plant.
    #[error(transparent)]
    Parameters(#[from] ParameterErrors),
    /// The rig.
    #[error(transparent)]
    Rig(#[from] RigError),
}
