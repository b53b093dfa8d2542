//! Recordings of published messages, as MCAP files.
//!
//! Each key is a topic; each payload is stored verbatim as JSON with its schema. `log_time` and `publish_time` are the
//! message's own time, `sequence` is its step. The recorder adds two kinds of messages: divergences as objects keyed by
//! component ([`by_component`]), which viewers plot by name, and losses ([`Loss`]).
//!
//! | file | what |
//! |---|---|
//! | `recorded` | a message with its time and step |
//! | `channels` | the schema of each topic |
//! | `divergence`, `loss` | the recorder's own messages |
//! | `writer` | one file |
//! | `files` | a series of files, with a limit on all of them (`quota`) |
//! | `records` | a file, record by record, finished or not |
//! | `reader` | its messages |
//! | `recovery` | copies the readable part of a damaged file into a finished one |

use std::time::Duration;

mod channels;
mod divergence;
mod error;
mod files;
mod loss;
mod quota;
mod reader;
mod recorded;
mod records;
mod recovery;
mod writer;

pub use divergence::by_component;
pub use error::RecordingError;
pub use files::{FileLimits, RecordingFiles};
pub use loss::Loss;
pub use reader::{Messages, Recording};
pub use recorded::{Recorded, Stamp};
pub use records::Ending;
pub use recovery::{Recovered, recover};
pub use writer::{Metadata, Writer};

/// So long a recorder asks for the state of a process that it has not heard from its start. What was published before that
/// state cannot be compared, and later it is not asked for.
pub const STATE_WITHIN: Duration = Duration::from_secs(20);
