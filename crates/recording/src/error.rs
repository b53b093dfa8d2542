//! What can go wrong with a recording.

use std::path::PathBuf;

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
