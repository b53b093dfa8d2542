//! A journal open for appending.

use std::fs::File;
use std::io::Write;
use std::path::Path;

use crate::damage::{Damage, DamageKind};
use crate::error::{FileError, OpenError, WriteError};
use crate::files::{self, JournalFiles};
use crate::line;
use crate::lines::{LinePart, LineReader};
use crate::lock::Lock;
use crate::rotation;

/// A journal open for appending. No other handle can open it while this one exists.
#[derive(Debug)]
pub struct Journal {
    files: JournalFiles,
    /// The present file.
    file: File,
    /// Its length without the remains of a failed append.
    bytes: u64,
    /// A failed append left remains that could not be truncated.
    torn: bool,
    /// A rotation failed at its last step: the present file is still called `journal.new`.
    misnamed: bool,
    _lock: Lock,
}

/// A journal that was just opened, with its content.
#[derive(Debug)]
pub struct Opened {
    /// The journal.
    pub journal: Journal,
    /// All valid records, oldest first, of the older and then of the present file. They are durable.
    pub records: Vec<String>,
    /// Everything else that the files contained.
    pub damage: Vec<Damage>,
}

impl Journal {
    /// Opens a journal for appending, and creates it if it does not exist: the directory for its owner only (mode 0700,
    /// also missing parents), and the files in it (0600).
    ///
    /// Truncates an incomplete last record, skips corrupt lines, which remain in the file, and completes or undoes an
    /// interrupted rotation.
    ///
    /// # Errors
    /// The journal is in use by this process or another one, or it cannot be read or written.
    pub fn open(directory: &Path) -> Result<Opened, OpenError> {
        if directory.exists() && !directory.is_dir() {
            return Err(OpenError::NotADirectory { path: directory.to_owned() });
        }
        files::create_directory(directory)?;
        let files = JournalFiles::of(directory);
        let lock = Lock::acquire(&files)?;
        rotation::settle(&files)?;
        Ok(Self::load(files, lock)?)
    }

    fn load(files: JournalFiles, lock: Lock) -> Result<Opened, FileError> {
        let (mut records, mut damage) = (Vec::new(), Vec::new());
        let mut load = |file: &File, path: &Path| load(file, path, &mut records, &mut damage);
        if let Some(older) = files::open_if_there(&files::appending(), &files.older)? {
            load(&older, &files.older)?;
        }
        let file = files::appending()
            .create(true)
            .open(&files.present)
            .map_err(FileError::of("open", &files.present))?;
        let bytes = load(&file, &files.present)?;
        files.sync_names()?;
        let journal = Journal { files, file, bytes, torn: false, misnamed: false, _lock: lock };
        Ok(Opened { journal, records, damage })
    }

    /// Appends a record. When this returns, the record survives the end of this process; it is durable only after
    /// [`sync`](Self::sync).
    ///
    /// # Errors
    /// The record has more than one line or is too long; or the write failed, e.g. on a full disk. The journal is then
    /// unchanged, and further appends can succeed.
    pub fn append(&mut self, record: &str) -> Result<(), WriteError> {
        self.append_all([record])
    }

    /// Appends several records in one write. If the process or the machine dies meanwhile, only the first few of them
    /// may be present.
    ///
    /// # Errors
    /// Those of [`append`](Self::append); then none of the records is appended.
    pub fn append_all<S: AsRef<str>>(
        &mut self,
        records: impl IntoIterator<Item = S>,
    ) -> Result<(), WriteError> {
        let lines = line::encode(records)?;
        self.cut_off()?;
        if let Err(source) = self.file.write_all(&lines) {
            self.torn = true;
            // The error of the write is the one to report; the next append tries to truncate again.
            let _ = self.cut_off();
            return Err(FileError::of("write", self.path())(source).into());
        }
        self.bytes += lines.len() as u64;
        Ok(())
    }

    /// Waits until everything appended is durable.
    ///
    /// # Errors
    /// The disk reported an error. Records since the last success may then be missing after a loss of power, even if a
    /// further sync succeeds, because the kernel reports a write error only once. [`rotate`](Self::rotate) rewrites the
    /// present state.
    pub fn sync(&mut self) -> Result<(), WriteError> {
        Ok(self.file.sync_data().map_err(FileError::of("sync", self.path()))?)
    }

    /// Length of the present file in bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Begins a new present file with `snapshot`, records that describe the whole present state. The former present
    /// file becomes the older one, and the former older file is deleted. Everything is durable when this returns; a
    /// crash at any instant leaves the former present file, the snapshot or both.
    ///
    /// # Errors
    /// Those of [`append`](Self::append) and of the disk. The journal then continues with the present file or, if only
    /// the last step failed, with the new one; neither case loses any of the present state.
    pub fn rotate<S: AsRef<str>>(
        &mut self,
        snapshot: impl IntoIterator<Item = S>,
    ) -> Result<(), WriteError> {
        let lines = line::encode(snapshot)?;
        self.cut_off()?;
        self.install()?;
        self.sync()?;
        let next = rotation::prepare(&self.files, &lines)?;
        rotation::retire(&self.files)?;
        self.file = next;
        self.bytes = lines.len() as u64;
        self.misnamed = true;
        self.install()?;
        Ok(self.files.sync_names()?)
    }

    /// Truncates the remains of a failed append, so that no record begins in the middle of a line.
    fn cut_off(&mut self) -> Result<(), FileError> {
        if self.torn {
            self.file.set_len(self.bytes).map_err(FileError::of("truncate", self.path()))?;
            self.torn = false;
        }
        Ok(())
    }

    /// Renames the present file if a rotation failed to.
    fn install(&mut self) -> Result<(), FileError> {
        if self.misnamed {
            rotation::install(&self.files)?;
            self.misnamed = false;
        }
        Ok(())
    }

    fn path(&self) -> &Path {
        if self.misnamed { &self.files.next } else { &self.files.present }
    }
}

/// Reads a file, truncates an incomplete last record and syncs the rest. Returns the length.
fn load(
    file: &File,
    path: &Path,
    records: &mut Vec<String>,
    all: &mut Vec<Damage>,
) -> Result<u64, FileError> {
    let mut lines = LineReader::new(file.try_clone().map_err(FileError::of("open", path))?, path)?;
    while let Some(part) = lines.next_part()? {
        match part {
            LinePart::Record(record) => records.push(record),
            LinePart::Damage(damage) => {
                if damage.kind == DamageKind::TornTail {
                    file.set_len(damage.offset).map_err(FileError::of("truncate", path))?;
                }
                damage.add_to(all);
            }
        }
    }
    // A process that was killed may have left records that are only in the kernel's memory.
    file.sync_data().map_err(FileError::of("sync", path))?;
    Ok(file.metadata().map_err(FileError::of("read", path))?.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn what_could_not_be_cut_off_at_once_is_cut_off_before_the_next_append() {
        let directory = tempfile::tempdir().unwrap();
        let mut journal = Journal::open(directory.path()).unwrap().journal;
        journal.append("first").unwrap();
        // as a partial write leaves it whose truncation failed
        journal.file.write_all(b"0123abcd half a rec").unwrap();
        journal.torn = true;
        journal.append("second").unwrap();
        assert_eq!(journal.bytes(), fs::metadata(&journal.files.present).unwrap().len());
        drop(journal);
        let opened = Journal::open(directory.path()).unwrap();
        assert_eq!((opened.records.len(), opened.damage.len()), (2, 0));
    }

    #[test]
    fn a_rotation_whose_last_step_failed_is_ended_by_the_next_one_or_by_opening() {
        for rotate_again in [false, true] {
            let directory = tempfile::tempdir().unwrap();
            let mut journal = Journal::open(directory.path()).unwrap().journal;
            journal.append("first").unwrap();
            journal.rotate(["first in short"]).unwrap();
            fs::rename(&journal.files.present, &journal.files.next).unwrap();
            journal.misnamed = true;
            journal.append("second").unwrap();
            journal.sync().unwrap();
            let mut expected = vec!["first", "first in short", "second"];
            assert_eq!(read(directory.path()), expected);
            if rotate_again {
                journal.rotate(["both in short"]).unwrap();
                expected.remove(0);
                expected.push("both in short");
                assert_eq!(read(directory.path()), expected);
            }
            drop(journal);
            assert_eq!(Journal::open(directory.path()).unwrap().records, expected);
        }
    }

    fn read(directory: &Path) -> Vec<String> {
        crate::read(directory).unwrap().map(Result::unwrap).collect()
    }
}
