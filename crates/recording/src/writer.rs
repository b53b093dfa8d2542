//! Writes a recording.

use std::collections::BTreeMap;
use std::fs::{File, TryLockError};
use std::io::{BufWriter, Seek};
use std::path::{Path, PathBuf};

use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions};

use crate::channels::schema_of;
use crate::{Recorded, RecordingError};

/// The first message beyond this length ends a chunk; even with one of the longest samples, a chunk has at most 1 MiB
/// \[bytes\].
const CHUNK: u64 = 1024 * 1024 - 64 * 1024;
/// The profile of a file, in its header.
pub(crate) const PROFILE: &str = "trusswatch";
/// Compression level of zstd: a higher one would cost more processor time than the space is worth.
const LEVEL: u32 = 1;

/// A recording being written.
///
/// A chunk stays in memory until it is complete and is then written as a whole, so that an unfinished file is torn only at
/// its end.
pub struct Writer {
    file: PathBuf,
    out: mcap::Writer<BufWriter<File>>,
    disk: File,
    channels: BTreeMap<String, u16>,
}

/// Metadata of a recording.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Metadata {
    /// Its name.
    pub name: String,
    /// Its values, by name.
    pub values: BTreeMap<String, String>,
}

impl Writer {
    /// Begins a file. Other recorders do not delete it while it is being written.
    ///
    /// # Errors
    /// It exists or cannot be written.
    pub fn create(file: &Path) -> Result<Self, RecordingError> {
        let begun = Self::begin(file);
        let (out, disk) = begun.map_err(|error| RecordingError::writing(file, &error))?;
        Ok(Self { file: file.into(), out, disk, channels: BTreeMap::new() })
    }

    fn begin(file: &Path) -> Result<(mcap::Writer<BufWriter<File>>, File), McapError> {
        let out = File::create_new(file)?;
        Self::head(out).inspect_err(|_| {
            // A file without its first bytes, on a full disk, is useless.
            let _ = std::fs::remove_file(file);
        })
    }

    fn head(out: File) -> Result<(mcap::Writer<BufWriter<File>>, File), McapError> {
        match out.try_lock() {
            // A file system without locks.
            Ok(()) | Err(TryLockError::Error(_)) => {}
            Err(error @ TryLockError::WouldBlock) => return Err(std::io::Error::from(error).into()),
        }
        let disk = out.try_clone()?;
        let options = options().profile(PROFILE).library(library());
        let mut out = options.create(BufWriter::new(out))?;
        // From now on the file can be opened even if the process is killed.
        out.flush()?;
        disk.sync_data()?;
        Ok((out, disk))
    }

    /// Writes a message.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write(&mut self, message: &Recorded) -> Result<(), RecordingError> {
        self.try_write(message).map_err(|error| self.wrong(&error))
    }

    /// Writes metadata.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn note(&mut self, metadata: Metadata) -> Result<(), RecordingError> {
        let Metadata { name, values } = metadata;
        let record = mcap::records::Metadata { name, metadata: values };
        self.out.write_metadata(&record).map_err(|error| self.wrong(&error))
    }

    /// Syncs everything written so far to the disk.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn sync(&mut self) -> Result<(), RecordingError> {
        let flushed = self.out.flush();
        let synced = flushed.and_then(|()| Ok(self.disk.sync_data()?));
        synced.map_err(|error| self.wrong(&error))
    }

    /// Length of the file on the disk so far \[bytes\].
    ///
    /// # Errors
    /// The system does not report it.
    pub fn written(&mut self) -> Result<u64, RecordingError> {
        let position = self.disk.stream_position();
        position.map_err(|error| self.wrong(&error.into()))
    }

    /// Ends the file.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        let finished = self.out.finish().and_then(|_| Ok(self.disk.sync_all()?));
        finished.map_err(|error| RecordingError::writing(&self.file, &error))
    }

    /// Its file.
    #[must_use]
    pub fn file(&self) -> &Path {
        &self.file
    }

    fn wrong(&self, error: &McapError) -> RecordingError {
        RecordingError::writing(&self.file, error)
    }

    fn try_write(&mut self, message: &Recorded) -> Result<(), McapError> {
        let channel_id = match self.channels.get(&message.topic) {
            Some(id) => *id,
            None => self.add_channel(&message.topic)?,
        };
        let header = MessageHeader {
            channel_id,
            sequence: message.sequence,
            log_time: message.time_unix_ns,
            publish_time: message.time_unix_ns,
        };
        self.out.write_to_known_channel(&header, &message.payload)
    }

    fn add_channel(&mut self, topic: &str) -> Result<u16, McapError> {
        let (name, text) = schema_of(topic);
        let schema = self.out.add_schema(&name, "jsonschema", text.as_bytes())?;
        let id = self.out.add_channel(schema, topic, "json", &BTreeMap::new())?;
        self.channels.insert(topic.to_owned(), id);
        Ok(id)
    }
}

/// The options of all files, including recovered ones.
pub(crate) fn options() -> WriteOptions {
    WriteOptions::new()
        .chunk_size(Some(CHUNK))
        .disable_seeking(true)
        .compression_level(LEVEL)
        .compression_threads(0)
}

/// The name of the program in files.
pub(crate) fn library() -> String {
    format!("trusswatch {}", env!("CARGO_PKG_VERSION"))
}
