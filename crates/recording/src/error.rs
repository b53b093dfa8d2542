//! What can go wrong with a recording.

use std::fmt::Display;
use std::path::{Path, PathBuf};

/// A recording that cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("recording {}: {problem}", file.display())]
pub struct WriteError {
    /// The file.
    pub file: PathBuf,
    /// Why.
    pub problem: String,
}

/// A recording that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("recording {}: {problem}", file.display())]
pub struct ReadError {
    /// The file.
    pub file: PathBuf,
    /// Why.
    pub problem: String,
}

impl WriteError {
    pub(crate) fn of(file: &Path, problem: &impl Display) -> Self {
        Self { file: file.into(), problem: problem.to_string() }
    }
}

impl ReadError {
    pub(crate) fn of(file: &Path, problem: &impl Display) -> Self {
        Self { file: file.into(), problem: problem.to_string() }
    }
}
