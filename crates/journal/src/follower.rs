//! Reads a journal repeatedly without the lock, each time only the new records; and reads single records at known
//! places.

use std::fs::File;
use std::io::{self, ErrorKind};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

use crate::error::{FileError, OpenError};
use crate::files::{FoundFile, both};
use crate::line;
use crate::lines::{LinePart, LineReader};

/// One of the two files; used as the index of its part of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum WhichFile {
    Older = 0,
    Present = 1,
}

/// The place of a record, valid until a [`JournalLook`] reports that it starts anew.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordPlace {
    offset: u64,
    bytes: u32,
    file: WhichFile,
}

/// The position up to which a file has been read.
#[derive(Debug, Clone, PartialEq, Eq)]
struct ReadMark {
    identity: (u64, u64),
    /// The last record read, and the beginning of its line. A file with the same identity but another record there is a
    /// different file, or was truncated and continued differently.
    last: Option<(RecordPlace, Vec<u8>)>,
}

/// The position up to which a journal has been read.
#[derive(Debug)]
pub struct JournalFollower {
    directory: PathBuf,
    marks: [Option<ReadMark>; 2],
}

/// The content of a journal at one moment. Another handle may append and rotate meanwhile.
#[derive(Debug)]
pub struct JournalLook<'a> {
    follower: &'a mut JournalFollower,
    files: [Option<FoundFile>; 2],
    /// The parts not read yet; the file being read is the last one.
    unread: Vec<(WhichFile, LineReader)>,
    anew: bool,
}

impl JournalFollower {
    /// Starts before the first record of the journal in this directory.
    #[must_use]
    pub fn new(directory: &Path) -> Self {
        Self { directory: directory.to_owned(), marks: [None, None] }
    }

    /// Opens the files as they are at this moment.
    ///
    /// # Errors
    /// The directory does not exist, or a file in it cannot be read. A directory without a journal has no records.
    pub fn look(&mut self) -> Result<JournalLook<'_>, OpenError> {
        let files = both(&self.directory)?;
        let anew = !self.continues(&files)?;
        if anew {
            self.marks = [0, 1].map(|file: usize| {
                files[file].as_ref().map(|found| ReadMark { identity: found.identity, last: None })
            });
        }
        let mut unread = Vec::new();
        for which in [WhichFile::Present, WhichFile::Older] {
            if let Some(found) = &files[which as usize] {
                unread.push((which, self.rest_of(which, found)?));
            }
        }
        Ok(JournalLook { follower: self, files, unread, anew })
    }

    /// Whether these are the files read before, with the same records up to the positions read.
    fn continues(&self, files: &[Option<FoundFile>; 2]) -> Result<bool, OpenError> {
        for (mark, found) in self.marks.iter().zip(files) {
            match (mark, found) {
                (None, None) => {}
                (Some(mark), Some(found)) if mark.is_in(found)? => {}
                _ => return Ok(false),
            }
        }
        Ok(true)
    }

    /// The part after the last record read. Corrupt lines after it are read again, because one may belong to an append
    /// that was truncated and replaced meanwhile.
    fn rest_of(&self, which: WhichFile, found: &FoundFile) -> Result<LineReader, OpenError> {
        let last = self.marks[which as usize].as_ref().and_then(|mark| mark.last.as_ref());
        let from = last.map_or(0, |(place, _)| place.offset + u64::from(place.bytes));
        let file = found.file.try_clone().map_err(FileError::of("read", &found.path))?;
        Ok(LineReader::from(file, &found.path, from)?)
    }

    fn note(&mut self, place: RecordPlace, record: &str) {
        if let Some(mark) = &mut self.marks[place.file as usize] {
            mark.last = Some((place, line::checksum(record.as_bytes()).to_vec()));
        }
    }
}

impl ReadMark {
    fn is_in(&self, found: &FoundFile) -> Result<bool, OpenError> {
        if self.identity != found.identity {
            return Ok(false);
        }
        let Some((place, beginning)) = &self.last else { return Ok(true) };
        let line = line_at(&found.file, *place).map_err(FileError::of("read", &found.path))?;
        Ok(line.starts_with(beginning) && line::decode(&line).is_some())
    }
}

impl JournalLook<'_> {
    /// Whether the files are different ones, e.g. after a rotation: places of records read before are then invalid, and
    /// all records are returned again. Also true of the first look.
    #[must_use]
    pub fn is_anew(&self) -> bool {
        self.anew
    }

    /// The next record that no earlier look returned, oldest first, and its place; `None` at the end.
    ///
    /// # Errors
    /// A file cannot be read.
    pub fn next_record(&mut self) -> Result<Option<(RecordPlace, String)>, OpenError> {
        while let Some((file, lines)) = self.unread.last_mut() {
            let (file, offset) = (*file, lines.offset());
            match lines.next_part()? {
                Some(LinePart::Record(record)) => {
                    // The line of a valid record fits in 32 bits.
                    let bytes = (lines.offset() - offset) as u32;
                    let place = RecordPlace { offset, bytes, file };
                    self.follower.note(place, &record);
                    return Ok(Some((place, record)));
                }
                Some(LinePart::Damage(_)) => {}
                None => {
                    self.unread.pop();
                }
            }
        }
        Ok(None)
    }

    /// The record at a place; `None` if it is gone or damaged by now.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn record_at(&self, place: RecordPlace) -> Result<Option<String>, OpenError> {
        let Some(found) = &self.files[place.file as usize] else { return Ok(None) };
        let line = line_at(&found.file, place).map_err(FileError::of("read", &found.path))?;
        Ok(line::decode(&line).map(str::to_owned))
    }
}

/// As much of a line as the file contains.
fn line_at(file: &File, place: RecordPlace) -> io::Result<Vec<u8>> {
    let mut line = vec![0; place.bytes as usize];
    match file.read_exact_at(&mut line, place.offset) {
        Ok(()) => Ok(line),
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(Vec::new()),
        Err(error) => Err(error),
    }
}
