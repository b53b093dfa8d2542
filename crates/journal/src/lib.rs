//! An append-only file of checksummed records. It survives the death of its process at any instant, loss of power and a
//! full disk.
//!
//! A record is a line of text, whose meaning is up to the writer. A journal is a directory of its own:
//!
//! | file | what |
//! |---|---|
//! | `journal` | the present file, to which records are appended |
//! | `journal.old` | the older file: the present one before the latest [`Journal::rotate`] |
//! | `journal.new` | the next present file, during a rotation |
//! | `lock` | locked while a [`Journal`] exists; contains the process number of its holder |
//!
//! Every record is a line of the file: the CRC-32 of the text in eight hexadecimal digits, a space, the text, a
//! newline. `tail -f` and `cut -c 10-` show the texts. Damage affects only the lines that contain it; a damaged newline
//! affects the lines on both sides.
//!
//! Guarantees:
//!
//! - after [`Journal::append`], the record survives the process;
//! - after [`Journal::sync`], it survives loss of power too;
//! - after an error, the journal contains what it contained before.
//!
//! Cost: an append is one write to the kernel's memory, however many records it has. A sync waits for the disk,
//! hundreds of times as long, so frequent appends should share a sync. A rotation waits for the disk four times.
//! [`Journal::open`] reads both files into memory; [`read()`] keeps one record at a time; a [`JournalFollower`] reads
//! what is new. The present file should therefore be rotated when [`Journal::bytes`] has grown to a few megabytes.

mod damage;
mod error;
mod files;
mod follower;
mod journal;
mod line;
mod lines;
mod lock;
mod rotation;

pub use damage::{Damage, DamageKind};
pub use error::{FileError, MAX_RECORD_BYTES, OpenError, WriteError};
pub use files::state_file;
pub use follower::{JournalFollower, JournalLook, RecordPlace};
pub use journal::{Journal, Opened};
pub use lines::{Records, read};
