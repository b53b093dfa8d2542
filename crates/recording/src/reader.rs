//! Reads a recording.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use mcap::records::{MessageHeader, Record};

use crate::records::McapRecords;
use crate::{Ending, Metadata, Recorded, RecordingError};

/// A recording, finished or not. It is read chunk by chunk, because it may be larger than the memory.
#[derive(Debug)]
pub struct Recording {
    file: PathBuf,
}

/// The messages of a recording in the order in which they were written.
pub struct Messages<'a> {
    file: &'a Path,
    records: McapRecords,
    topics: BTreeMap<u16, String>,
}

/// Memory of a message besides its topic and its payload \[bytes\].
const PER_MESSAGE: usize = 64;

impl Recording {
    /// Opens a file, finished or not.
    ///
    /// # Errors
    /// The file cannot be read, or is not an MCAP file.
    pub fn open(file: &Path) -> Result<Self, RecordingError> {
        McapRecords::open(file).map_err(|error| RecordingError::reading(file, &error))?;
        Ok(Self { file: file.into() })
    }

    /// Its messages in the order in which they were written. A file that ends within a chunk, because the recorder was
    /// killed, ends without an error; see [`Messages::ending`].
    ///
    /// # Errors
    /// It cannot be read any more. The iterator returns an error for each damaged chunk or record, and continues after it.
    pub fn messages(&self) -> Result<Messages<'_>, RecordingError> {
        let records = self.records()?;
        Ok(Messages { file: &self.file, records, topics: BTreeMap::new() })
    }

    /// Its metadata in the order in which they were written. Of several with one name, the last counts.
    ///
    /// # Errors
    /// It cannot be read any more.
    pub fn metadata(&self) -> Result<Vec<Metadata>, RecordingError> {
        let records = self.records()?.skipping_chunks();
        let metadata = records.filter_map(|record| match record {
            Ok(Record::Metadata(found)) => {
                Some(Metadata { name: found.name, values: found.metadata })
            }
            _ => None,
        });
        Ok(metadata.collect())
    }

    fn records(&self) -> Result<McapRecords, RecordingError> {
        McapRecords::open(&self.file).map_err(|error| RecordingError::reading(&self.file, &error))
    }
}

impl Messages<'_> {
    /// How the file ends; `None` before the last message has been read.
    #[must_use]
    pub fn ending(&self) -> Option<Ending> {
        self.records.ending()
    }

    /// Adds the memory that the next record takes: readers keep the unpacked messages.
    fn count(&mut self, length: usize) -> Result<(), RecordingError> {
        let counted = self.records.note_unpacked(length);
        counted.map_err(|damage| RecordingError::reading(self.file, &damage))
    }

    fn message(
        &mut self,
        header: &MessageHeader,
        payload: Vec<u8>,
    ) -> Result<Recorded, RecordingError> {
        let MessageHeader { channel_id, sequence, log_time, .. } = *header;
        let topic = self.topics.get(&channel_id).cloned().ok_or_else(|| {
            let problem = format!("a message of the undescribed channel {channel_id}");
            RecordingError::reading(self.file, &problem)
        })?;
        self.count(topic.len() + payload.len() + PER_MESSAGE)?;
        Ok(Recorded { topic, time_unix_ns: log_time, sequence, payload })
    }

    fn of_record(&mut self, record: Record<'static>) -> Option<Result<Recorded, RecordingError>> {
        match record {
            Record::Channel(channel) => {
                let counted = self.count(channel.topic.len()).err();
                self.topics.insert(channel.id, channel.topic);
                counted.map(Err)
            }
            Record::Message { header, data } => Some(self.message(&header, data.into_owned())),
            // A recorder writes no such records, so this one is damaged.
            Record::Unknown { opcode, .. } => {
                let problem = format!("a record of unknown kind {opcode:#04x}");
                Some(Err(RecordingError::reading(self.file, &problem)))
            }
            _ => None,
        }
    }
}

impl Iterator for Messages<'_> {
    type Item = Result<Recorded, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let found = match self.records.next()? {
                Ok(record) => self.of_record(record),
                Err(damage) => Some(Err(RecordingError::reading(self.file, &damage))),
            };
            if found.is_some() {
                return found;
            }
        }
    }
}
