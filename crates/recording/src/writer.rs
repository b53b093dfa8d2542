//! Writes a recording.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions};

use crate::channels::schema_of;
use crate::{Recorded, WriteError};

/// A recording being written.
pub struct Writer {
    file: PathBuf,
    out: mcap::Writer<BufWriter<File>>,
    channels: BTreeMap<String, u16>,
}

impl Writer {
    /// Begins a file.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn create(file: &Path) -> Result<Self, WriteError> {
        let wrong = |problem: String| WriteError { file: file.into(), problem };
        let out = File::create_new(file).map_err(|error| wrong(error.to_string()))?;
        let options = WriteOptions::new().profile("trusswatch").library("trusswatch");
        let out = options.create(BufWriter::new(out)).map_err(|error| wrong(error.to_string()))?;
        Ok(Self { file: file.into(), out, channels: BTreeMap::new() })
    }

    /// Writes a message.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write(&mut self, message: &Recorded) -> Result<(), WriteError> {
        self.try_write(message).map_err(|error| self.wrong(&error))
    }

    /// Ends the file.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn finish(mut self) -> Result<(), WriteError> {
        self.out.finish().map(drop).map_err(|error| self.wrong(&error))
    }

    fn wrong(&self, error: &McapError) -> WriteError {
        WriteError { file: self.file.clone(), problem: error.to_string() }
    }

    fn try_write(&mut self, message: &Recorded) -> Result<(), McapError> {
        let known = self.channels.get(&message.topic).copied();
        let channel_id = match known {
            Some(id) => id,
            None => {
                let (name, text) = schema_of(&message.topic);
                let schema = self.out.add_schema(&name, "jsonschema", text.as_bytes())?;
                let id = self.out.add_channel(schema, &message.topic, "json", &BTreeMap::new())?;
                self.channels.insert(message.topic.clone(), id);
                id
            }
        };
        let header = MessageHeader {
            channel_id,
            sequence: message.sequence,
            log_time: message.time_unix_ns,
            publish_time: message.time_unix_ns,
        };
        self.out.write_to_known_channel(&header, &message.payload)
    }
}
