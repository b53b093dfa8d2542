//! Reads a file record by record and chunk by chunk, finished or not.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::ops::Range;
use std::path::Path;

use crc32fast::Hasher;
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{MAGIC, McapError, McapResult};

use crate::writer::PROFILE;

/// Length of the prefix of a record: its kind and its length \[bytes\].
pub(crate) const PREFIX: usize = 1 + 8;
/// Length of the part of a footer that its checksum covers \[bytes\].
const COVERED: usize = 8 + 8;

/// Largest ratio of unpacked to packed length. A recorder's files unpack to about ten times their length.
const MOST_COMPRESSED: u64 = 256;
/// Unpacked length permitted whatever the ratio \[bytes\].
const UNPACKED_ANYWAY: u64 = 16 * 1024 * 1024;

/// How a recording ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// With its summary, so it was finished.
    Finished,
    /// After a whole record, without a summary.
    Unfinished,
    /// Within a chunk that begins at this byte.
    WithinChunk(u64),
    /// Within another record that begins at this byte.
    WithinRecord(u64),
}

impl std::fmt::Display for Ending {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Ending::Finished => f.write_str("finished"),
            Ending::Unfinished => f.write_str("not finished"),
            Ending::WithinChunk(at) => write!(f, "ends within a chunk, which begins at byte {at}"),
            Ending::WithinRecord(at) => {
                write!(f, "ends within a record, which begins at byte {at}")
            }
        }
    }
}

/// Damage at a position in a file. Reading continues after it.
#[derive(Debug, thiserror::Error)]
#[error("byte {at}: {problem}")]
pub(crate) struct McapDamage {
    at: u64,
    problem: String,
}

/// The records of a file in order, including those in chunks.
pub(crate) struct McapRecords {
    input: BufReader<File>,
    /// Length of the file when it was opened, and of the part read so far \[bytes\].
    length: u64,
    position: u64,
    /// What was counted of the unpacked records so far \[bytes\].
    unpacked: u64,
    record: Vec<u8>,
    unpacker: Unpacker,
    /// The position of the chunk being unpacked.
    chunk: Option<u64>,
    single: Option<Record<'static>>,
    /// The checksum of the data or, after their end, of the summary.
    checksum: Hasher,
    ending: Option<Ending>,
    skips_chunks: bool,
    /// The recorder's files have all messages in chunks; a message outside is a damaged record.
    is_ours: bool,
}

impl McapRecords {
    /// # Errors
    /// The file cannot be read, or is not an MCAP file.
    pub(crate) fn open(file: &Path) -> io::Result<Self> {
        let file = File::open(file)?;
        let length = file.metadata()?.len();
        let mut records = Self {
            input: BufReader::with_capacity(1 << 16, file),
            length,
            position: 0,
            unpacked: 0,
            record: Vec::new(),
            unpacker: Unpacker::new(),
            chunk: None,
            single: None,
            checksum: Hasher::new(),
            ending: None,
            skips_chunks: false,
            is_ours: false,
        };
        records.magic()?;
        Ok(records)
    }

    /// Likewise without the records in chunks.
    pub(crate) fn skipping_chunks(self) -> Self {
        Self { skips_chunks: true, ..self }
    }

    /// How the file ends, once it has been read.
    pub(crate) fn ending(&self) -> Option<Ending> {
        self.ending
    }

    /// Counts the length of a record that was unpacked \[bytes\]. A small file can unpack to any amount: from where it
    /// becomes implausible, the rest is left out.
    pub(crate) fn note_unpacked(&mut self, length: usize) -> Result<(), McapDamage> {
        self.unpacked += length as u64;
        if self.unpacked <= UNPACKED_ANYWAY.max(self.position.saturating_mul(MOST_COMPRESSED)) {
            return Ok(());
        }
        let at = self.chunk.unwrap_or(self.position);
        (self.chunk, self.ending) = (None, Some(Ending::Unfinished));
        let problem = format!(
            "what the file has so far unpacks to more than {MOST_COMPRESSED} times its length; the rest is left out"
        );
        Err(McapDamage { at, problem })
    }

    fn magic(&mut self) -> io::Result<()> {
        let length = self.left().min(MAGIC.len() as u64) as usize;
        self.record.clear();
        self.read(length)?;
        if self.record != MAGIC[..length] {
            return Err(io::Error::other("not an MCAP file: wrong first bytes"));
        }
        if length < MAGIC.len() {
            self.ending = Some(Ending::WithinRecord(0));
        }
        self.checksum.update(&self.record);
        Ok(())
    }

    fn left(&self) -> u64 {
        self.length - self.position
    }

    /// Appends this many bytes to the record.
    fn read(&mut self, count: usize) -> io::Result<()> {
        let before = self.record.len();
        self.record.resize(before + count, 0);
        self.input.read_exact(&mut self.record[before..])?;
        self.position += count as u64;
        Ok(())
    }

    /// Reads the next record of the file; a chunk counts as one.
    fn advance(&mut self) -> Result<(), McapDamage> {
        let at = self.position;
        let damage = |problem: String| McapDamage { at, problem };
        if self.left() < PREFIX as u64 {
            let whole = self.left() == 0;
            self.ending = Some(if whole { Ending::Unfinished } else { Ending::WithinRecord(at) });
            return Ok(());
        }
        self.record.clear();
        self.read(PREFIX).map_err(|error| self.unreadable(at, &error))?;
        let opcode = self.record[0];
        let length = self.record[1..].iter().rev().fold(0, |sum, byte| sum << 8 | u64::from(*byte));
        if length > self.left() {
            let within =
                if opcode == op::CHUNK { Ending::WithinChunk } else { Ending::WithinRecord };
            self.ending = Some(within(at));
            return self.complain_if_finished(at);
        }
        if opcode == op::CHUNK && self.skips_chunks || length > LONGEST as u64 {
            self.skip(length).map_err(|error| self.unreadable(at, &error))?;
            let too_long =
                || damage(format!("a record of {length} bytes is too long; it is left out"));
            return if opcode == op::CHUNK && self.skips_chunks { Ok(()) } else { Err(too_long()) };
        }
        self.read(length as usize).map_err(|error| self.unreadable(at, &error))?;
        let checked = self.check(opcode);
        if opcode == op::CHUNK {
            self.begin_chunk(at).map_err(damage)?;
        } else {
            self.single = Some(self.single(opcode).map_err(damage)?);
        }
        checked.map_err(damage)
    }

    /// Starts unpacking the chunk that was read.
    fn begin_chunk(&mut self, at: u64) -> Result<(), String> {
        let header = &self.record[PREFIX..];
        let length = header.get(LENGTH_UNPACKED).and_then(|bytes| bytes.first_chunk());
        match length.map(|bytes| u64::from_le_bytes(*bytes)) {
            Some(length) if length > LONGEST_CHUNK as u64 => Err(format!(
                "a chunk of {length} bytes is too long: at most {LONGEST_CHUNK} bytes; it is left out"
            )),
            _ => {
                self.unpacker.begin();
                self.chunk = Some(at);
                Ok(())
            }
        }
    }

    /// The next record of the chunk that is being unpacked.
    fn unpack(&mut self) -> Option<Result<Record<'static>, McapDamage>> {
        let at = self.chunk?;
        let unpacked = self.unpacker.next(&self.record);
        if !matches!(unpacked, Some(Ok(_))) {
            self.chunk = None;
        }
        let damage = |error: McapError| McapDamage { at, problem: error.to_string() };
        unpacked.map(|record| record.map_err(damage))
    }

    /// Parses the record outside of chunks that was read.
    fn single(&mut self, opcode: u8) -> Result<Record<'static>, String> {
        let record = mcap::parse_record(opcode, &self.record[PREFIX..]);
        let record = record.map_err(|error| error.to_string())?.into_owned();
        match &record {
            Record::Header(header) => self.is_ours = header.profile == PROFILE,
            Record::Message { .. } if self.is_ours => {
                return Err(
                    "a message outside of chunks, which the recorder does not write".to_owned()
                );
            }
            _ => {}
        }
        Ok(record)
    }

    fn skip(&mut self, length: u64) -> io::Result<()> {
        let ahead = i64::try_from(length).map_err(io::Error::other)?;
        self.input.seek_relative(ahead)?;
        self.position += length;
        Ok(())
    }

    fn unreadable(&mut self, at: u64, error: &io::Error) -> McapDamage {
        self.ending = Some(Ending::WithinRecord(at));
        McapDamage { at, problem: format!("the file cannot be read: {error}") }
    }

    /// In a finished file, a record that seems to end after the file has a wrong length.
    fn complain_if_finished(&mut self, at: u64) -> Result<(), McapDamage> {
        let mut rest = Vec::new();
        let read = self.input.read_to_end(&mut rest);
        if read.is_ok() && rest.ends_with(MAGIC) {
            let problem = "the length of a record is wrong; what follows is left out".to_owned();
            return Err(McapDamage { at, problem });
        }
        Ok(())
    }

    /// Updates the checksums and compares them with those in the file.
    fn check(&mut self, opcode: u8) -> Result<(), String> {
        // Skipped records are not included in the checksum.
        let check = |found: Hasher, bytes: &[u8], what: &str| {
            let wanted = bytes.first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
            let right = wanted == 0 || self.skips_chunks || found.finalize() == wanted;
            if right { Ok(()) } else { Err(format!("the checksum of the {what} is wrong")) }
        };
        match opcode {
            op::DATA_END => {
                let found = std::mem::take(&mut self.checksum);
                check(found, &self.record[PREFIX..], "data")
            }
            op::FOOTER => {
                let (covered, rest) =
                    self.record.split_at((PREFIX + COVERED).min(self.record.len()));
                self.checksum.update(covered);
                let checked = check(std::mem::take(&mut self.checksum), rest, "summary");
                self.ending = Some(Ending::Finished);
                checked
            }
            _ => {
                self.checksum.update(&self.record);
                Ok(())
            }
        }
    }
}

impl Iterator for McapRecords {
    type Item = Result<Record<'static>, McapDamage>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(record) = self.single.take() {
                return Some(Ok(record));
            }
            if let Some(record) = self.unpack() {
                return Some(record);
            }
            if self.ending.is_some() {
                return None;
            }
            if let Err(damage) = self.advance() {
                return Some(Err(damage));
            }
        }
    }
}

/// The position of the unpacked length in a chunk: after the times of its first and last message \[bytes\].
const LENGTH_UNPACKED: Range<usize> = 16..24;
/// Longest record, and longest chunk before unpacking \[bytes\].
const LONGEST: usize = 256 * 1024 * 1024;
/// Longest chunk after unpacking, because a small file can demand any amount of memory \[bytes\].
const LONGEST_CHUNK: usize = 64 * 1024 * 1024;

/// Unpacks chunks record by record: all records of a chunk together may need several times its length.
struct Unpacker {
    reader: LinearReader,
    /// Length of the part of the chunk passed to the reader \[bytes\].
    given: usize,
}

impl Unpacker {
    fn new() -> Self {
        // The checksum of a chunk, if it has one, is verified before any of its records is used.
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(LONGEST);
        Self { reader: LinearReader::new_with_options(options), given: 0 }
    }

    fn begin(&mut self) {
        self.given = 0;
    }

    /// The next record in a chunk, which is passed as a whole each time; none after an error.
    fn next(&mut self, chunk: &[u8]) -> Option<McapResult<Record<'static>>> {
        let next = self.try_next(chunk).transpose();
        if matches!(next, Some(Err(_))) {
            *self = Self::new();
        }
        next
    }

    fn try_next(&mut self, chunk: &[u8]) -> McapResult<Option<Record<'static>>> {
        loop {
            match self.reader.next_event().transpose()? {
                Some(LinearReadEvent::ReadRequest(need)) => {
                    let rest = &chunk[self.given..];
                    if rest.is_empty() {
                        return Ok(None);
                    }
                    let now = &rest[..need.min(rest.len())];
                    self.reader.insert(now.len()).copy_from_slice(now);
                    self.reader.notify_read(now.len());
                    self.given += now.len();
                }
                Some(LinearReadEvent::Record { opcode, data }) => {
                    return Ok(Some(mcap::parse_record(opcode, data)?.into_owned()));
                }
                None => return Err(McapError::UnexpectedEof),
            }
        }
    }
}
