//! What can go wrong with a recording.

use std::error::Error;
use std::fmt::Display;
use std::io;
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
    /// What the system says of it, if it does: that the disk is full is more than that writing failed.
    pub(crate) fn of(file: &Path, error: &(dyn Error + 'static)) -> Self {
        let mut problem = error.to_string();
        let mut cause = error.source();
        while let Some(error) = cause {
            if error.is::<io::Error>() {
                problem = error.to_string();
            }
            cause = error.source();
        }
        Self { file: file.into(), problem }
    }
}

impl ReadError {
    pub(crate) fn of(file: &Path, problem: &impl Display) -> Self {
        Self { file: file.into(), problem: problem.to_string() }
    }
}
