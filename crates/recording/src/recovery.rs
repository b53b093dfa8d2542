//! Copies the readable part of a damaged or unfinished file into a finished one. Works for files of other programs, too:
//! schemas, channels, metadata, attachments and private records are kept.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use mcap::records::{Channel, Header, Record, SchemaHeader};
use mcap::{Attachment, McapError, McapResult};

use crate::records::{McapRecords, PREFIX};
use crate::writer::{library, options};
use crate::{Ending, RecordingError};

/// The result of a recovery.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recovered {
    /// The number of recovered messages.
    pub messages: u64,
    /// Descriptions of what could not be recovered.
    pub problems: Vec<String>,
    /// How the file ended.
    pub ending: Ending,
}

/// Writes the readable part of a file into another, finished one. Damaged chunks are left out, and what follows after a
/// small file has unpacked to very much.
///
/// # Errors
/// The file cannot be read or is not an MCAP file; the other exists or cannot be written.
pub fn recover(from: &Path, to: &Path) -> Result<Recovered, RecordingError> {
    let open = || McapRecords::open(from).map_err(|error| RecordingError::reading(from, &error));
    let wrong = |error: McapError| RecordingError::writing(to, &error);
    let header = match open()?.skipping_chunks().next() {
        Some(Ok(Record::Header(header))) => header,
        _ => Header { profile: String::new(), library: library() },
    };
    let mut copy = Copy::begin(to, header).map_err(wrong)?;
    // The summary, if there is one, repeats the schemas and channels.
    for record in open()?.skipping_chunks().flatten() {
        copy.describe(record).map_err(wrong)?;
    }
    let mut records = open()?;
    while let Some(record) = records.next() {
        let counted = record.and_then(|record| {
            records.note_unpacked(length(&record))?;
            Ok(record)
        });
        match counted {
            Ok(record) => copy.take(record).map_err(wrong)?,
            Err(damage) => copy.recovered.problems.push(damage.to_string()),
        }
    }
    copy.recovered.ending = records.ending().unwrap_or(Ending::Unfinished);
    copy.finish().map_err(wrong)
}

/// Length of a record that may be in a chunk \[bytes\].
fn length(record: &Record<'_>) -> usize {
    PREFIX
        + match record {
            Record::Message { data, .. } => MESSAGE_HEADER + data.len(),
            Record::Schema { data, .. } => data.len(),
            Record::Channel(channel) => channel.topic.len(),
            Record::Unknown { data, .. } => data.len(),
            _ => 0,
        }
}

/// Length of a message record before the payload \[bytes\].
const MESSAGE_HEADER: usize = 2 + 4 + 8 + 8;

/// The finished file.
struct Copy {
    out: mcap::Writer<BufWriter<File>>,
    recovered: Recovered,
}

impl Copy {
    fn begin(to: &Path, header: Header) -> McapResult<Self> {
        let out = BufWriter::new(File::create_new(to)?);
        let out = options().profile(header.profile).library(header.library).create(out)?;
        let recovered = Recovered { messages: 0, problems: Vec::new(), ending: Ending::Unfinished };
        Ok(Self { out, recovered })
    }

    fn take(&mut self, record: Record<'static>) -> McapResult<()> {
        match record {
            Record::Message { header, data } => {
                let written = self.out.write_to_known_channel(&header, &data);
                if written.is_ok() {
                    self.recovered.messages += 1;
                }
                self.unless_of_content(written)
            }
            Record::Attachment { header, data, .. } => self.out.attach(&Attachment {
                log_time: header.log_time,
                create_time: header.create_time,
                name: header.name,
                media_type: header.media_type,
                data,
            }),
            Record::Metadata(metadata) => self.out.write_metadata(&metadata),
            Record::Unknown { opcode, data } => {
                let written = self.out.write_private_record(opcode, &data, Default::default());
                self.unless_of_content(written)
            }
            other => self.describe(other),
        }
    }

    /// Copies schemas and channels.
    fn describe(&mut self, record: Record<'static>) -> McapResult<()> {
        let added = match record {
            Record::Schema { header: SchemaHeader { id, name, encoding }, data } => {
                self.out.add_schema_with_id(id, &name, &encoding, &data)
            }
            Record::Channel(Channel { id, schema_id, topic, message_encoding, metadata }) => {
                self.out.add_channel_with_id(id, schema_id, &topic, &message_encoding, &metadata)
            }
            _ => return Ok(()),
        };
        self.unless_of_content(added.map(drop))
    }

    /// Contradictory records are left out; a failure to write is an error.
    fn unless_of_content(&mut self, written: McapResult<()>) -> McapResult<()> {
        match written {
            Err(error @ (McapError::Io(_) | McapError::AttemptedWriteAfterFailure)) => Err(error),
            Err(error) => {
                self.note(error.to_string());
                Ok(())
            }
            Ok(()) => Ok(()),
        }
    }

    /// Records a problem once.
    fn note(&mut self, problem: String) {
        const MOST: usize = 100;
        let problems = &mut self.recovered.problems;
        if problems.len() < MOST && !problems.contains(&problem) {
            problems.push(problem);
        }
    }

    fn finish(mut self) -> McapResult<Recovered> {
        self.out.finish()?;
        let mut out = self.out.into_inner();
        out.flush()?;
        out.get_ref().sync_all()?;
        Ok(self.recovered)
    }
}
