//! What can go wrong in a study.

use std::path::PathBuf;

use plant::{ParameterErrors, PlantError};
use vocabulary::StructureName;

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
    /// No component of the structure can have the fault that was drawn.
    #[error("the structure needs at least one actuator and one gage for its scenarios")]
    NothingToBreak,
    /// The structure has not what a figure of the paper shows.
    #[error("structure `{structure}` has no {what}, which the figure needs")]
    Lacks {
        /// The structure.
        structure: StructureName,
        /// What is missing, by its position.
        what: String,
    },
    /// A recording could not be written.
    #[error("cannot write the recording: {0}")]
    Write(#[from] std::io::Error),
    /// It was stopped before the plant of a case was commissioned.
    #[error("interrupted")]
    Interrupted,
    /// A journal could not be written.
    #[error("cannot write `{}`: {error}", path.display())]
    File {
        /// The journal.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// A journal that cannot be used.
    #[error("`{}` {problem}", path.display())]
    Journal {
        /// The journal.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// A reference that cannot be made.
    #[error(transparent)]
    Commissioning(#[from] diagnosis::state::CommissioningError),
    /// The rig.
    #[error(transparent)]
    Rig(#[from] RigError),
}
