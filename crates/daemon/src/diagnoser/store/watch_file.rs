//! How far the module had watched. Overwritten many times a second and never waited for, so that it
//! costs nothing: a killed process leaves it in the kernel's hands, and after a loss of power an old
//! one only means that less is known.
//!
//! Two places are written in turn, so that one of them is always whole.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;

use process::WatchedSteps;
use serde::{Deserialize, Serialize};

const PLACE_BYTES: usize = 256;

#[derive(Debug, Serialize, Deserialize)]
struct WatchEntry {
    number: u64,
    #[serde(flatten)]
    watch: WatchedSteps,
}

/// The file.
#[derive(Debug)]
pub(crate) struct WatchFile {
    file: File,
    number: u64,
}

impl WatchFile {
    /// Opens the file in a directory, with what it says.
    ///
    /// # Errors
    /// It cannot be opened for writing.
    pub(crate) fn open(directory: &Path) -> std::io::Result<(Self, Option<WatchedSteps>)> {
        let mut options = journal::state_file();
        let file =
            options.write(true).create(true).truncate(false).open(directory.join("watch"))?;
        let entries = (0..2).filter_map(|place| read(&file, place));
        let latest = entries.max_by_key(|entry| entry.number);
        let number = latest.as_ref().map_or(0, |entry| entry.number);
        Ok((Self { file, number }, latest.map(|entry| entry.watch)))
    }

    /// Writes how far the module has watched.
    ///
    /// # Errors
    /// It cannot be written; the one before still stands.
    pub(crate) fn write(&mut self, watch: WatchedSteps) -> std::io::Result<()> {
        self.number += 1;
        let entry = WatchEntry { number: self.number, watch };
        let text = serde_json::to_string(&entry).map_err(std::io::Error::other)?;
        let sum = crc32fast::hash(text.as_bytes());
        let line = format!("{sum:08x} {text}");
        let padded = format!("{line:<width$}\n", width = PLACE_BYTES - 1);
        self.file.write_all_at(padded.as_bytes(), (self.number % 2) * PLACE_BYTES as u64)
    }
}

fn read(file: &File, place: u64) -> Option<WatchEntry> {
    let mut bytes = [0; PLACE_BYTES];
    file.read_exact_at(&mut bytes, place * PLACE_BYTES as u64).ok()?;
    let line = std::str::from_utf8(&bytes).ok()?.trim_end();
    let (sum, text) = line.split_once(' ')?;
    let sum = u32::from_str_radix(sum, 16).ok()?;
    if sum != crc32fast::hash(text.as_bytes()) {
        return None;
    }
    serde_json::from_str(text).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use vocabulary::{RunId, Step};

    fn watch(until: u64) -> WatchedSteps {
        WatchedSteps { run: RunId(u64::MAX), watched: Some((Step(3), Step(until))) }
    }

    #[test]
    fn the_latest_is_read_back() {
        let directory = tempfile::tempdir().unwrap();
        let (mut file, nothing) = WatchFile::open(directory.path()).unwrap();
        assert_eq!(nothing, None);
        for until in 10..20 {
            file.write(watch(until)).unwrap();
            let (_, read) = WatchFile::open(directory.path()).unwrap();
            assert_eq!(read, Some(watch(until)));
        }
    }

    #[test]
    fn a_torn_entry_leaves_the_one_before() {
        let directory = tempfile::tempdir().unwrap();
        let (mut file, _) = WatchFile::open(directory.path()).unwrap();
        file.write(watch(10)).unwrap();
        file.write(watch(11)).unwrap();
        file.file.write_all_at(b"12", 20).unwrap();
        let (_, read) = WatchFile::open(directory.path()).unwrap();
        assert_eq!(read, Some(watch(10)));
    }
}
