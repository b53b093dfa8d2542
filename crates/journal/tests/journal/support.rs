//! What the tests have in common.

use std::path::{Path, PathBuf};

use journal::{Journal, Opened};

pub(crate) fn open(directory: &Path) -> Opened {
    Journal::open(directory).unwrap()
}

/// What is read without the lock.
pub(crate) fn read(directory: &Path) -> Vec<String> {
    journal::read(directory).unwrap().map(Result::unwrap).collect()
}

pub(crate) fn present(directory: &Path) -> PathBuf {
    directory.join("journal")
}

/// The present file's bytes after these records.
pub(crate) fn bytes_of(records: &[&str]) -> Vec<u8> {
    let directory = tempfile::tempdir().unwrap();
    open(directory.path()).journal.append_all(records).unwrap();
    std::fs::read(present(directory.path())).unwrap()
}
