//! Records out of chunks.

use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, McapResult};

/// Longest record, and longest chunk before and after unpacking: what a damaged file asks for is not to exhaust the
/// memory \[bytes\].
pub(crate) const LONGEST: usize = 256 * 1024 * 1024;

/// Unpacks one chunk after another.
pub(crate) struct Unpacker(LinearReader);

impl Unpacker {
    pub(crate) fn new() -> Self {
        // Nothing of a chunk is used before its checksum has been found right.
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(LONGEST);
        Self(LinearReader::new_with_options(options))
    }

    /// The records in a chunk, which is given as a whole record.
    pub(crate) fn unpack(&mut self, chunk: &[u8]) -> McapResult<Vec<Record<'static>>> {
        let unpacked = self.try_unpack(chunk);
        if unpacked.is_err() {
            *self = Self::new();
        }
        unpacked
    }

    fn try_unpack(&mut self, mut rest: &[u8]) -> McapResult<Vec<Record<'static>>> {
        let mut records = Vec::new();
        loop {
            match self.0.next_event().transpose()? {
                Some(LinearReadEvent::ReadRequest(need)) => {
                    if rest.is_empty() {
                        return Ok(records);
                    }
                    let (now, later) = rest.split_at(need.min(rest.len()));
                    self.0.insert(now.len()).copy_from_slice(now);
                    self.0.notify_read(now.len());
                    rest = later;
                }
                Some(LinearReadEvent::Record { opcode, data }) => {
                    records.push(mcap::parse_record(opcode, data)?.into_owned());
                }
                None => return Err(McapError::UnexpectedEof),
            }
        }
    }
}
