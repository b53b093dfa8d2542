//! What outlives the process.
//!
//! | file | job |
//! |---|---|
//! | `record` | one record of the journal as text |
//! | `recollection` | from records back to what the diagnoser knew |
//! | `snapshot` | of records, those that say all of the present state |
//! | `keeper` | the open journal: writes, waits for the disk, keeps what could not be written yet |
//! | `watch_file` | how far the module had watched, overwritten all the time |
//! | `write_queue` | what is to be written; whoever publishes it waits for the disk for a limited time |
//! | `writer` | the thread that writes it |
//! | `directory` | all of it together, for tests from outside |

mod directory;
mod keeper;
mod recollection;
mod record;
mod snapshot;
mod watch_file;
mod write_queue;
mod writer;

pub use directory::StateDirectory;
pub(crate) use keeper::Keeper;
pub(crate) use recollection::{Entries, Entry, Recollection};
pub(crate) use record::Record;
pub(crate) use watch_file::{Watch, WatchFile};
pub(crate) use write_queue::{JournalBoard, Submission};
pub(crate) use writer::Writer;
