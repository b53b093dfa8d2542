//! Replaces the present file by the next. A crash may occur between any two steps:
//!
//! | step | `journal.old` | `journal` | `journal.new` | after a crash |
//! |---|---|---|---|---|
//! | before | A | B | | |
//! | the snapshot is being written | A | B | part of C | C is removed |
//! | the snapshot is on the disk | A | B | C | C is removed |
//! | B became the older file, replacing A | B | | C | C becomes the present file |
//! | C became the present file | B | C | | |
//!
//! B contains the whole present state until C is durable, and both exist when A is replaced. A `journal.new` without a
//! `journal` is therefore complete, and is the present file.

use std::fs::File;
use std::io::Write;

use crate::error::FileError;
use crate::files::{self, JournalFiles};

/// Completes or undoes an interrupted rotation.
pub(crate) fn settle(files: &JournalFiles) -> Result<(), FileError> {
    let present = files.present.try_exists().map_err(FileError::of("open", &files.present))?;
    let next = files.next.try_exists().map_err(FileError::of("open", &files.next))?;
    match (present, next) {
        (_, false) => Ok(()),
        (true, true) => files::remove_if_there(&files.next),
        (false, true) => install(files),
    }
}

/// Writes and syncs the next file. After an error the next file does not exist.
pub(crate) fn prepare(files: &JournalFiles, lines: &[u8]) -> Result<File, FileError> {
    files::remove_if_there(&files.next)?;
    let prepared = write(files, lines);
    if prepared.is_err() {
        discard(files);
    }
    prepared
}

fn write(files: &JournalFiles, lines: &[u8]) -> Result<File, FileError> {
    let mut next = files::appending()
        .create_new(true)
        .open(&files.next)
        .map_err(FileError::of("create", &files.next))?;
    let written = next.write_all(lines).and_then(|()| next.sync_all());
    written.map_err(FileError::of("write", &files.next))?;
    // The new name must be durable before the present file is renamed.
    files.sync_names()?;
    Ok(next)
}

/// Renames the present file to the older one. After an error the next file does not exist.
pub(crate) fn retire(files: &JournalFiles) -> Result<(), FileError> {
    let retired = files::rename(&files.present, &files.older);
    if retired.is_err() {
        discard(files);
    }
    retired
}

/// Renames the next file to the present one.
pub(crate) fn install(files: &JournalFiles) -> Result<(), FileError> {
    files::rename(&files.next, &files.present)
}

/// Deletes the next file to free its space. If that fails, the file is harmless beside a present file.
fn discard(files: &JournalFiles) {
    let _ = files::remove_if_there(&files.next);
}
