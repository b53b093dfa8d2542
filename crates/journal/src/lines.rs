//! Reads a journal without the lock while it is being written: the lines of each file up to its length at the time of
//! opening, in constant memory.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::iter::FusedIterator;
use std::path::{Path, PathBuf};

use crate::damage::{Damage, DamageKind};
use crate::error::{FileError, OpenError};
use crate::files::both;
use crate::line::{self, MAX_LINE_BYTES};

const BUFFER_BYTES: usize = 1 << 16;

/// A part of a file.
pub(crate) enum LinePart {
    Record(String),
    Damage(Damage),
}

/// A file being read.
#[derive(Debug)]
pub(crate) struct LineReader {
    path: PathBuf,
    reader: BufReader<File>,
    /// The offset of the next line.
    offset: u64,
    /// The file's length; later appends are not read.
    end: u64,
    /// The present line, at most as long as a record.
    line: Vec<u8>,
}

impl LineReader {
    /// Reads `file` from its beginning; damages and errors name it `path`.
    pub(crate) fn new(file: File, path: &Path) -> Result<Self, FileError> {
        let end = file.metadata().map_err(FileError::of("read", path))?.len();
        let reader = BufReader::with_capacity(BUFFER_BYTES, file);
        Ok(Self { path: path.to_owned(), reader, offset: 0, end, line: Vec::new() })
    }

    /// Reads `file` from the line at this offset on, if the file is that long.
    pub(crate) fn from(file: File, path: &Path, offset: u64) -> Result<Self, FileError> {
        let mut lines = Self::new(file, path)?;
        lines.seek(offset).map_err(FileError::of("read", path))?;
        Ok(lines)
    }

    /// The offset of the next part.
    pub(crate) fn offset(&self) -> u64 {
        self.offset
    }

    /// The next part of the file; `None` at its end and from then on.
    pub(crate) fn next_part(&mut self) -> Result<Option<LinePart>, FileError> {
        let offset = self.offset;
        let mut part = self.scan(offset);
        // Without the lock, the line may be a mixture of a failed append that was truncated and the append that
        // replaced it. The file itself contains the right line by now.
        if matches!(&part, Ok(Some(LinePart::Damage(_)))) {
            part = self.seek(offset).and_then(|()| self.scan(offset));
        }
        if matches!(&part, Ok(Some(LinePart::Damage(Damage { kind: DamageKind::TornTail, .. })))) {
            self.end = self.offset;
        }
        part.map_err(FileError::of("read", &self.path))
    }

    fn seek(&mut self, offset: u64) -> io::Result<()> {
        self.reader.seek(SeekFrom::Start(offset))?;
        self.offset = offset;
        Ok(())
    }

    fn scan(&mut self, offset: u64) -> io::Result<Option<LinePart>> {
        let has_end = self.take_line()?;
        let bytes = self.offset - offset;
        if bytes == 0 {
            return Ok(None);
        }
        if has_end
            && bytes <= MAX_LINE_BYTES as u64
            && let Some(record) = line::decode(&self.line)
        {
            return Ok(Some(LinePart::Record(record.to_owned())));
        }
        let kind = if has_end { DamageKind::Corrupt } else { DamageKind::TornTail };
        Ok(Some(LinePart::Damage(Damage { file: self.path.clone(), offset, bytes, kind })))
    }

    /// Reads up to the next newline; returns false at the end of the file.
    fn take_line(&mut self) -> io::Result<bool> {
        self.line.clear();
        loop {
            if self.line.len() == MAX_LINE_BYTES {
                // too long for a record, so only look for its end
                self.line.clear();
            }
            let room = (MAX_LINE_BYTES - self.line.len()) as u64;
            let most = room.min(self.end.saturating_sub(self.offset));
            let read = self.reader.by_ref().take(most).read_until(b'\n', &mut self.line)?;
            self.offset += read as u64;
            if read == 0 || self.line.ends_with(b"\n") {
                return Ok(read > 0);
            }
        }
    }
}

/// The records in a journal at the moment of opening, oldest first, in constant memory. Skips damaged lines, and ends after
/// an error of the file system.
#[derive(Debug)]
pub struct Records {
    /// The files left to read; the one being read is the last.
    files: Vec<LineReader>,
}

/// Reads the records of the older and then of the present file. Needs no lock: another handle may append and rotate
/// meanwhile. A last record that is only partly written is ignored.
///
/// # Errors
/// The directory does not exist, or a file in it cannot be read. A directory without a journal has no records.
pub fn read(directory: &Path) -> Result<Records, OpenError> {
    let mut lines = Vec::new();
    for file in both(directory)?.into_iter().rev().flatten() {
        lines.push(LineReader::new(file.file, &file.path)?);
    }
    Ok(Records { files: lines })
}

impl Iterator for Records {
    type Item = Result<String, OpenError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            match self.files.last_mut()?.next_part() {
                Ok(Some(LinePart::Record(record))) => return Some(Ok(record)),
                Ok(Some(LinePart::Damage(_))) => {}
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::MAX_RECORD_BYTES;

    fn parts(bytes: &[u8]) -> Vec<Result<String, (u64, u64, DamageKind)>> {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("file");
        std::fs::write(&path, bytes).unwrap();
        let mut lines = LineReader::new(File::open(&path).unwrap(), &path).unwrap();
        let mut parts = Vec::new();
        while let Some(part) = lines.next_part().unwrap() {
            parts.push(match part {
                LinePart::Record(record) => Ok(record),
                LinePart::Damage(damage) => Err((damage.offset, damage.bytes, damage.kind)),
            });
        }
        assert!(lines.next_part().unwrap().is_none());
        parts
    }

    #[test]
    fn a_line_too_long_is_skipped_even_if_its_end_looks_like_a_record() {
        let record = line::encode(["record"]).unwrap();
        let long = vec![b'x'; MAX_LINE_BYTES];
        let bytes = [&record[..], &long, &record, &record].concat();
        let corrupt =
            (record.len() as u64, (long.len() + record.len()) as u64, DamageKind::Corrupt);
        let record = || Ok("record".to_owned());
        assert_eq!(parts(&bytes), [record(), Err(corrupt), record()]);
    }

    #[test]
    fn a_tail_of_any_length_is_torn_as_a_whole() {
        let record = line::encode(["record"]).unwrap();
        for length in [1, 4096, MAX_LINE_BYTES, 2 * MAX_LINE_BYTES, 3 * MAX_RECORD_BYTES] {
            // as loss of power leaves it: the length is on the disk, the bytes are not
            let bytes = [&record[..], &vec![0; length]].concat();
            let torn = (record.len() as u64, length as u64, DamageKind::TornTail);
            assert_eq!(parts(&bytes), [Ok("record".to_owned()), Err(torn)]);
        }
    }

    #[test]
    fn a_replaced_line_is_reread() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("file");
        let write = |record: &str| {
            let records = ["first", record];
            std::fs::write(&path, line::encode(records).unwrap()).unwrap();
        };
        write("damaged");
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, bytes.to_ascii_uppercase()).unwrap();
        let mut lines = LineReader::new(File::open(&path).unwrap(), &path).unwrap();
        // everything is in the buffer by now
        lines.reader.fill_buf().unwrap();
        write("correct");
        for expected in ["first", "correct"] {
            let part = lines.next_part().unwrap();
            assert!(matches!(part, Some(LinePart::Record(record)) if record == expected));
        }
    }
}
