//! Reading a journal without the lock, while it is being written.

use std::iter::FusedIterator;
use std::path::Path;

use crate::damage::DamageKind;
use crate::error::ReadError;
use crate::found::both;
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
    let mut lines = Vec::new();
    for file in both(directory)?.into_iter().rev().flatten() {
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
