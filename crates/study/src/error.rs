//! Errors of studies.

use std::path::PathBuf;

use plant::{ParameterErrors, PlantError};
use vocabulary::StructureName;

use crate::rig::RigError;

/// Why a study failed.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The plant.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// Parameters of the plant.
    #[error(transparent)]
    Parameters(#[from] ParameterErrors),
    /// No component of the structure can have the drawn fault.
    #[error("the structure needs at least one actuator and one gage for its scenarios")]
    NothingToBreak,
    /// The structure lacks a component that a figure of the paper shows.
    #[error("structure `{structure}` has no {what}, which the figure needs")]
    Lacks {
        /// The structure.
        structure: StructureName,
        /// The missing component, by its position.
        what: String,
    },
    /// A recording could not be written.
    #[error("cannot write the recording: {0}")]
    Write(#[from] std::io::Error),
    /// The study was stopped before the plant of a case was commissioned.
    #[error("interrupted")]
    Interrupted,
    /// A journal could not be written.
    #[error("cannot write `{}`: {error}", path.display())]
    File {
        /// The journal.
        path: PathBuf,
        /// The cause.
        error: std::io::Error,
    },
    /// A journal is not usable.
    #[error("`{}` {problem}", path.display())]
    Journal {
        /// The journal.
        path: PathBuf,
        /// The problem.
        problem: String,
    },
    /// A reference cannot be learned.
    #[error(transparent)]
    Commissioning(#[from] diagnosis::state::CommissioningError),
    /// The detectors that others are compared with cannot be trained.
    #[error("{0}")]
    Training(String),
    /// The rig.
    #[error(transparent)]
    Rig(#[from] RigError),
}
