//! What outlives the process.
//!
//! | file | job |
//! |---|---|
//! | `record` | one record of the journal as text |
//! | `recollection` | from records back to what the diagnoser knew |
//! | `keeper` | the open journal: writes, waits for the disk, keeps what could not be written yet |
//! | `watch_file` | how far the module had watched, overwritten all the time |
//! | `directory` | all of it together, for tests from outside |

mod directory;
mod keeper;
mod recollection;
mod record;
mod watch_file;

pub use directory::StateDirectory;
pub(crate) use keeper::{Board, Keeper};
pub(crate) use recollection::{Entry, Recollection, entries};
pub(crate) use record::Record;
pub(crate) use watch_file::{Watch, WatchFile};
