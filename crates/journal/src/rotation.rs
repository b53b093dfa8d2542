//! From one present file to the next. A crash can come between any two steps:
//!
//! | step | `journal.old` | `journal` | `journal.new` | after a crash |
//! |---|---|---|---|---|
//! | before | A | B | | |
//! | the snapshot is being written | A | B | part of C | C is removed |
//! | the snapshot is on the disk | A | B | C | C is removed |
//! | B became the older file, replacing A | B | | C | C becomes the present file |
//! | C became the present file | B | C | | |
//!
//! B has all of the present state until C has it on the disk, and both are there when A goes. A
//! `journal.new` without a `journal` is therefore complete, and is the present file.

use std::fs::File;
use std::io::Write;

use crate::error::FileError;
use crate::files::{self, JournalFiles};

/// Ends or undoes a rotation that was cut short.
pub(crate) fn settle(files: &JournalFiles) -> Result<(), FileError> {
    let present = files.present.try_exists().map_err(FileError::of("open", &files.present))?;
    let next = files.next.try_exists().map_err(FileError::of("open", &files.next))?;
    match (present, next) {
        (_, false) => Ok(()),
        (true, true) => files::remove_if_there(&files.next),
        (false, true) => install(files),
    }
}

/// Writes the next file and waits until the disk has it. After an error there is none.
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
    // The name too must be there before the present file's name goes.
    files.sync_names()?;
    Ok(next)
}

/// Makes the present file the older one. After an error there is no next file.
pub(crate) fn retire(files: &JournalFiles) -> Result<(), FileError> {
    let retired = files::rename(&files.present, &files.older);
    if retired.is_err() {
        discard(files);
    }
    retired
}

/// Makes the next file the present one.
pub(crate) fn install(files: &JournalFiles) -> Result<(), FileError> {
    files::rename(&files.next, &files.present)
}

/// Gives the next file's space back. One that stays does no harm beside a present file.
fn discard(files: &JournalFiles) {
    let _ = files::remove_if_there(&files.next);
}
