//! Errors, each with the path of the file or directory.

use std::io;
use std::path::{Path, PathBuf};

/// Longer records are refused.
pub const MAX_RECORD_BYTES: usize = 1 << 20;

/// An operation of the operating system failed.
#[derive(Debug, thiserror::Error)]
#[error("cannot {doing} `{}`: {source}", .path.display())]
pub struct FileError {
    /// The operation, a verb like `create`.
    pub doing: &'static str,
    /// The file or directory.
    pub path: PathBuf,
    /// The cause.
    pub source: io::Error,
}

impl FileError {
    /// Wraps the error of an operation on a file or directory, for `map_err`.
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
        /// The process that holds it, if known.
        holder: Option<u32>,
    },
    /// The path is not a directory.
    #[error("`{}` is not a directory; a journal is a directory of its own", .path.display())]
    NotADirectory {
        /// The path to be opened or read.
        path: PathBuf,
    },
    /// An operation of the operating system failed.
    #[error(transparent)]
    Io(#[from] FileError),
}

fn named(holder: Option<u32>) -> String {
    match holder {
        Some(pid) if pid == std::process::id() => {
            format!("process {pid}, this one, which may still be waiting for the disk")
        }
        Some(pid) => format!("process {pid}"),
        None => "another process".to_owned(),
    }
}

/// Why records were not written; the journal is unchanged.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// A record with more than one line.
    #[error("the record has a newline at byte {at}; a record is a single line")]
    Newline {
        /// The position of the newline, counted from 0.
        at: usize,
    },
    /// A record that is too long.
    #[error("{bytes} bytes are too many; a record has at most {MAX_RECORD_BYTES}")]
    TooLong {
        /// Its length.
        bytes: usize,
    },
    /// An operation of the operating system failed.
    #[error(transparent)]
    Io(#[from] FileError),
}
