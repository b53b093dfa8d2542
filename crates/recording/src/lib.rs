//! Recordings of what was published, as MCAP files.
//!
//! Each key is a topic, each payload is kept verbatim as JSON with its schema; `log_time` and `publish_time` are the
//! message's own time, `sequence` is its step.

mod channels;
mod error;
mod reader;
mod writer;

pub use error::{ReadError, WriteError};
pub use reader::Recording;
pub use writer::Writer;

/// A recorded message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recorded {
    /// The key that it was published on.
    pub topic: String,
    /// Its own time \[ns since 1970\].
    pub time_unix_ns: u64,
    /// Its step; 0 if it has none. Of a step beyond 2³² the lower half.
    pub sequence: u32,
    /// Its bytes as they were published.
    pub payload: Vec<u8>,
}
