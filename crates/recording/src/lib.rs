//! Recordings of published messages, as MCAP files.
//!
//! Each key is a topic, each payload is kept verbatim as JSON with its schema; `log_time` and `publish_time` are the
//! message's own time, `sequence` is its step. Beside them stand two kinds of messages of the recorder's own:
//! divergences once more as objects keyed by component ([`by_component`]), which viewers plot by name, and what the
//! recorder lost ([`Loss`]).
//!
//! | file | what |
//! |---|---|
//! | `recorded` | a message with its time and step |
//! | `channels` | the schema of each topic |
//! | `divergence`, `loss` | the recorder's own messages |
//! | `writer` | one file |
//! | `files` | one file after another, with a limit on all of them (`quota`) |
//! | `records` | a file, record by record, finished or not |
//! | `reader` | its messages |
//! | `recovery` | what can be read of a damaged file, as a finished one |

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
