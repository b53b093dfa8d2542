//! Errors of recordings.

use std::error::Error;
use std::fmt::Display;
use std::io;
use std::path::{Path, PathBuf};

/// A recording that cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// It cannot be read.
    #[error("recording {}: {problem}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Why.
        problem: String,
    },
    /// It cannot be written.
    #[error("recording {}: {problem}", file.display())]
    Write {
        /// The file or directory.
        file: PathBuf,
        /// Why.
        problem: String,
    },
}

impl RecordingError {
    pub(crate) fn reading(file: &Path, problem: &impl Display) -> Self {
        Self::Read { file: file.into(), problem: problem.to_string() }
    }

    /// With the system's reason, if there is one: "disk full" says more than "writing failed".
    pub(crate) fn writing(file: &Path, error: &(dyn Error + 'static)) -> Self {
        let mut problem = error.to_string();
        let mut cause = error.source();
        while let Some(error) = cause {
            if error.is::<io::Error>() {
                problem = error.to_string();
            }
            cause = error.source();
        }
        Self::Write { file: file.into(), problem }
    }
}
