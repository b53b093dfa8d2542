//! What can go wrong, each with the path it went wrong at.

use std::io;
use std::path::{Path, PathBuf};

/// Longer records are refused.
pub const MAX_RECORD_BYTES: usize = 1 << 20;

/// The operating system refused something.
#[derive(Debug, thiserror::Error)]
#[error("cannot {doing} `{}`: {source}", .path.display())]
pub struct FileError {
    /// What was refused, a verb like `create`.
    pub doing: &'static str,
    /// The file or directory it was refused for.
    pub path: PathBuf,
    /// Why.
    pub source: io::Error,
}

impl FileError {
    /// Makes the error of what is done to a file or directory, for `map_err`.
    pub(crate) fn of(doing: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self { doing, path: path.to_owned(), source }
    }
}

/// A journal that cannot be opened or read.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// Another handle has it open, in this process or in another one.
    #[error(
        "journal `{}` is in use by {}; it takes one writer at a time",
        .directory.display(), named(*.holder)
    )]
    InUse {
        /// The journal.
        directory: PathBuf,
        /// The process that holds it, where that could be read.
        holder: Option<u32>,
    },
    /// There is something else where the directory should be.
    #[error("`{}` is not a directory; a journal is a directory of its own", .path.display())]
    NotADirectory {
        /// What was to be opened or read.
        path: PathBuf,
    },
    /// The operating system refused something.
    #[error(transparent)]
    Io(#[from] FileError),
}

fn named(holder: Option<u32>) -> String {
    holder.map_or_else(|| "another process".to_owned(), |pid| format!("process {pid}"))
}

/// Records that were not written; the journal is as it was before.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// A record of more than one line.
    #[error("the record has a newline at byte {at}; a record is a single line")]
    Newline {
        /// Where, counted from 0.
        at: usize,
    },
    /// A record too long.
    #[error("{bytes} bytes are too many; a record has at most {MAX_RECORD_BYTES}")]
    TooLong {
        /// How many.
        bytes: usize,
    },
    /// The operating system refused something.
    #[error(transparent)]
    Io(#[from] FileError),
}
