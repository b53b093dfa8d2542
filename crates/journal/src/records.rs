//! Reading a journal without the lock, while it is being written.

use std::fs::{self, File};
use std::iter::FusedIterator;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use crate::damage::DamageKind;
use crate::error::{FileError, ReadError};
use crate::files::{self, Files};
use crate::lines::{Lines, Part};

/// The records that a journal held when it was asked, oldest first. In constant memory; a record
/// that cannot be read is the last.
#[derive(Debug)]
pub struct Records {
    /// The file being read is the last one.
    files: Vec<Lines>,
    passed_over: u64,
}

/// What a journal holds at this moment, of the older and then of the present file. It needs no lock:
/// another handle may append and rotate meanwhile. A last record that is only partly written is not
/// there yet.
///
/// # Errors
/// There is no such directory, or a file in it cannot be read. A directory without a journal has no
/// records.
pub fn read(directory: &Path) -> Result<Records, ReadError> {
    let metadata = fs::metadata(directory).map_err(FileError::of("read", directory))?;
    if !metadata.is_dir() {
        return Err(ReadError::NotADirectory { path: directory.to_owned() });
    }
    let mut lines = Vec::new();
    for file in both(&Files::of(directory))?.into_iter().rev().flatten() {
        lines.push(Lines::new(file.file, &file.path)?);
    }
    Ok(Records { files: lines, passed_over: 0 })
}

impl Records {
    /// How many corrupt lines were passed over up to now.
    #[must_use]
    pub fn passed_over(&self) -> u64 {
        self.passed_over
    }
}

impl Iterator for Records {
    type Item = Result<String, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            match self.files.last_mut()?.next_part() {
                Ok(Some(Part::Record(record))) => return Some(Ok(record)),
                Ok(Some(Part::Damage(damage))) => {
                    self.passed_over += u64::from(damage.kind == DamageKind::Corrupt);
                }
                Ok(None) => {
                    self.files.pop();
                }
                Err(error) => {
                    self.files.clear();
                    return Some(Err(error.into()));
                }
            }
        }
    }
}

impl FusedIterator for Records {}

/// A file, and the path it was found at.
struct Found {
    path: PathBuf,
    file: File,
    /// Device and number on it; no other file has them as long as this one is open.
    identity: (u64, u64),
}

/// The older and the present file. Each moves on in a rotation, so both are looked for again until
/// they are the same as before; else a whole file could be missed or read twice.
fn both(files: &Files) -> Result<[Option<Found>; 2], FileError> {
    loop {
        let present = present(files)?;
        let older = find(&files.older)?;
        let again = [self::present(files)?, find(&files.older)?];
        if [identity(&present), identity(&older)] == [identity(&again[0]), identity(&again[1])] {
            return Ok([older, present]);
        }
    }
}

fn identity(found: &Option<Found>) -> Option<(u64, u64)> {
    found.as_ref().map(|found| found.identity)
}

/// The present file, which a rotation leaves without its name for an instant.
fn present(files: &Files) -> Result<Option<Found>, FileError> {
    match find(&files.present)? {
        Some(present) => Ok(Some(present)),
        None => find(&files.next),
    }
}

fn find(path: &Path) -> Result<Option<Found>, FileError> {
    let Some(file) = files::open_if_there(File::options().read(true), path)? else {
        return Ok(None);
    };
    let metadata = file.metadata().map_err(FileError::of("read", path))?;
    let identity = (metadata.dev(), metadata.ino());
    Ok(Some(Found { path: path.to_owned(), file, identity }))
}
