//! Reads a recording.

use std::path::{Path, PathBuf};

use mcap::MessageStream;
use mcap::read::Options;

use crate::{ReadError, Recorded};

/// A recording in memory.
#[derive(Debug)]
pub struct Recording {
    file: PathBuf,
    bytes: Vec<u8>,
}

impl Recording {
    /// Opens a file; one that was not finished too.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn open(file: &Path) -> Result<Self, ReadError> {
        let bytes = std::fs::read(file)
            .map_err(|error| ReadError { file: file.into(), problem: error.to_string() })?;
        Ok(Self { file: file.into(), bytes })
    }

    /// Its messages in the order in which they were written.
    ///
    /// # Errors
    /// It is no recording; each message that cannot be read.
    pub fn messages(
        &self,
    ) -> Result<impl Iterator<Item = Result<Recorded, ReadError>> + '_, ReadError> {
        let wrong = |error: mcap::McapError| ReadError {
            file: self.file.clone(),
            problem: error.to_string(),
        };
        let messages = MessageStream::new_with_options(&self.bytes, Options::IgnoreEndMagic.into())
            .map_err(wrong)?;
        Ok(messages.map(move |message| {
            let message = message.map_err(wrong)?;
            Ok(Recorded {
                topic: message.channel.topic.clone(),
                time_unix_ns: message.log_time,
                sequence: message.sequence,
                payload: message.data.into_owned(),
            })
        }))
    }
}
