//! Reading a journal again and again without the lock, each time only what is new, and single records at their
//! places.

use std::fs::File;
use std::io::{self, ErrorKind};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

use crate::error::{FileError, OpenError};
use crate::files::{FoundFile, both};
use crate::line;
use crate::lines::{LinePart, LineReader};

/// WhichFile of the two files; the index of its part of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum WhichFile {
    Older = 0,
    Present = 1,
}

/// Where a record stands, for as long as a [`JournalLook`] is not anew.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordPlace {
    offset: u64,
    bytes: u32,
    file: WhichFile,
}

/// How far a file has been read.
#[derive(Debug, Clone, PartialEq, Eq)]
struct ReadMark {
    identity: (u64, u64),
    /// Its last record, if it has any, and the beginning of that line. A file of the same identity that has another
    /// record there is another file, or was cut off and went on differently.
    last: Option<(RecordPlace, Vec<u8>)>,
}

/// How far a journal has been read.
#[derive(Debug)]
pub struct JournalFollower {
    directory: PathBuf,
    marks: [Option<ReadMark>; 2],
}

/// What a journal holds at one moment. Another handle may append and rotate meanwhile.
#[derive(Debug)]
pub struct JournalLook<'a> {
    follower: &'a mut JournalFollower,
    files: [Option<FoundFile>; 2],
    /// What was not read yet; the file being read is the last one.
    unread: Vec<(WhichFile, LineReader)>,
    anew: bool,
}

impl JournalFollower {
    /// Nothing of the journal in this directory has been read.
    #[must_use]
    pub fn new(directory: &Path) -> Self {
        Self { directory: directory.to_owned(), marks: [None, None] }
    }

    /// Opens the files as they are at this moment.
    ///
    /// # Errors
    /// There is no such directory, or a file in it cannot be read. A directory without a journal has no records.
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

    /// Are these the files read before, with the same records as far as they were read?
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

    /// What comes after the last record read. Corrupt lines behind it are read again: one may be of an append
    /// that was cut off and replaced meanwhile.
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
    /// Places of records read before this look hold no more, and all records come again: the files are others, by
    /// a rotation say. At the first look this is so too.
    #[must_use]
    pub fn is_anew(&self) -> bool {
        self.anew
    }

    /// The next record that was not read by an earlier look, oldest first, and its place; none at the end.
    ///
    /// # Errors
    /// A file cannot be read.
    pub fn next_record(&mut self) -> Result<Option<(RecordPlace, String)>, OpenError> {
        while let Some((file, lines)) = self.unread.last_mut() {
            let (file, offset) = (*file, lines.offset());
            match lines.next_part()? {
                Some(LinePart::Record(record)) => {
                    // A line of a record is not longer.
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

    /// The record at a place; none if it is gone or damaged by now.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn record_at(&self, place: RecordPlace) -> Result<Option<String>, OpenError> {
        let Some(found) = &self.files[place.file as usize] else { return Ok(None) };
        let line = line_at(&found.file, place).map_err(FileError::of("read", &found.path))?;
        Ok(line::decode(&line).map(str::to_owned))
    }
}

/// As much as there is of a line.
fn line_at(file: &File, place: RecordPlace) -> io::Result<Vec<u8>> {
    let mut line = vec![0; place.bytes as usize];
    match file.read_exact_at(&mut line, place.offset) {
        Ok(()) => Ok(line),
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(Vec::new()),
        Err(error) => Err(error),
    }
}
