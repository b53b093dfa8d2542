//! What is written to a journal, and when it counts as kept: records first, and when the disk has them, how far the module
//! has watched. So the watch never says more than the journal can prove.
//!
//! What cannot be written (a full disk, a directory that is read-only) is kept and tried again. Where that gets too
//! much, the oldest of it is dropped, and what is written next is a new file with the present state.

use std::collections::VecDeque;
use std::time::Duration;

use vocabulary::JournalStatus;

use crate::record::{JOURNAL_VERSION, JournalRecord, WatchedSteps};
use crate::store_state::StoreState;
use crate::write_queue::WriteBatch;

/// Records that may wait for a disk.
const MAX_UNSAVED: usize = 16_384;
/// How often a disk that refused is tried again.
const RETRY: Duration = Duration::from_secs(1);

/// A journal on a disk, and the file beside it that says how far the module had watched.
pub trait Disk {
    /// Opens the journal, with what it holds and how many of its records are damaged.
    ///
    /// # Errors
    /// Why it cannot be opened.
    fn open(&mut self) -> Result<(Vec<String>, u64), String>;
    /// Gives the opened journal up.
    fn close(&mut self);
    /// Is the journal open?
    fn is_open(&self) -> bool;
    /// Appends records: they survive the process.
    ///
    /// # Errors
    /// The disk refuses; the journal contains what it contained before.
    fn append(&mut self, records: &VecDeque<String>) -> Result<(), String>;
    /// Waits for the disk: what was appended survives a loss of power.
    ///
    /// # Errors
    /// The disk refuses; what was appended may be lost.
    fn sync(&mut self) -> Result<(), String>;
    /// Begins a new file with these records; the present one is kept as the older one. Waits for the disk.
    ///
    /// # Errors
    /// The disk refuses; the journal contains what it contained before.
    fn rotate(&mut self, records: Vec<String>) -> Result<(), String>;
    /// The length of the present file.
    fn bytes(&self) -> u64;
    /// Writes how far the module has watched.
    ///
    /// # Errors
    /// The disk refuses.
    fn write_watch(&mut self, watch: WatchedSteps) -> Result<(), String>;
}

/// What waits for the disk, and how the journal is.
#[derive(Debug, Default)]
pub struct JournalKeeper {
    /// How the journal is.
    pub status: JournalStatus,
    /// What a journal holds that could not be opened at the start is not known.
    pub is_unread: bool,
    rotate_bytes: u64,
    unsaved: VecDeque<String>,
    /// The disk may lack what was appended, or never got it: only a new file is certain to be whole.
    incomplete: bool,
}

impl JournalKeeper {
    /// For a journal in this directory; without one nothing is kept. A new file is begun when the present one has got
    /// larger than `rotate_bytes`.
    #[must_use]
    pub fn new(directory: Option<String>, rotate_bytes: u64) -> Self {
        let status = JournalStatus { directory, ..JournalStatus::default() };
        Self { status, rotate_bytes, ..Self::default() }
    }

    /// The record that a process begins to write: whether the disk takes anything shows before there is a fault.
    #[must_use]
    pub fn start(&self, now_unix_ns: u64) -> JournalRecord {
        JournalRecord::Start {
            v: JOURNAL_VERSION,
            software: env!("CARGO_PKG_VERSION").to_owned(),
            time_unix_ns: now_unix_ns,
            incarnation: self.status.incarnation,
        }
    }

    /// After what time without anything to write the disk is tried again, if it is.
    #[must_use]
    pub fn retry(&self) -> Option<Duration> {
        self.is_behind().then_some(RETRY)
    }

    /// Takes what there is to be written from the store.
    #[must_use]
    pub fn take(
        &self,
        store: &mut StoreState,
        disk: &dyn Disk,
        now: std::time::Instant,
    ) -> (WriteBatch, Option<Vec<JournalRecord>>) {
        // After a failure the kernel does not try again, so that only a new file is certain to be whole.
        let is_too_large = disk.is_open() && disk.bytes() > self.rotate_bytes;
        store.take_writes(self.incomplete || is_too_large, now)
    }

    /// Writes it, and waits for the disk. Returns whether that has everything so far; what it has not is tried again with the
    /// next. `snapshot`: the present state, with which a new file begins.
    pub fn write(
        &mut self,
        (batch, snapshot): (WriteBatch, Option<Vec<JournalRecord>>),
        disk: &mut dyn Disk,
    ) -> bool {
        self.status.lost += batch.dropped;
        self.incomplete |= batch.dropped > 0;
        let nothing_to_do = batch.records.is_empty() && self.is_up_to_date();
        let durable = nothing_to_do || self.save(batch.records, snapshot, disk);
        if let Some(watch) = batch.watch.filter(|_| durable)
            && let Err(error) = disk.write_watch(watch)
        {
            tracing::debug!("watch file: {error}");
        }
        durable
    }

    fn save(
        &mut self,
        records: Vec<JournalRecord>,
        snapshot: Option<Vec<JournalRecord>>,
        disk: &mut dyn Disk,
    ) -> bool {
        self.unsaved.extend(texts(records));
        if self.status.directory.is_none() {
            self.unsaved.clear();
            return false;
        }
        let saved = self.flush(snapshot, disk);
        self.drop_oldest();
        self.status.unsaved = self.unsaved.len() as u64;
        saved
    }

    /// Is anything waiting for the disk?
    fn is_behind(&self) -> bool {
        self.status.directory.is_some() && (!self.unsaved.is_empty() || self.incomplete)
    }

    /// Has the disk everything that there is to be kept?
    fn is_up_to_date(&self) -> bool {
        self.status.directory.is_some() && !self.is_behind()
    }

    fn flush(&mut self, snapshot: Option<Vec<JournalRecord>>, disk: &mut dyn Disk) -> bool {
        if !disk.is_open()
            && let Err(problem) = self.open_at_last(disk)
        {
            self.tell_problem(&problem);
        }
        if !disk.is_open() {
            return false;
        }
        let outcome = disk.append(&self.unsaved).and_then(|()| {
            self.unsaved.clear();
            self.incomplete = true;
            match snapshot {
                Some(snapshot) => disk.rotate(texts(snapshot)),
                None => disk.sync(),
            }
        });
        match outcome {
            Ok(()) => {
                self.incomplete = false;
                self.tell_success(disk.bytes());
                true
            }
            Err(error) => {
                self.tell_problem(&error);
                false
            }
        }
    }

    /// Opens the journal that could not be opened at the start, unless it turns out to hold unknown
    /// faults: their numbers must not be given again.
    fn open_at_last(&mut self, disk: &mut dyn Disk) -> Result<(), String> {
        let (records, damaged) = disk.open()?;
        self.status.damaged = damaged;
        self.status.bytes = disk.bytes();
        if self.is_unread && !records.is_empty() {
            disk.close();
            let problem = "could not be read at startup; restart to load its faults";
            return Err(problem.to_owned());
        }
        self.is_unread = false;
        Ok(())
    }

    fn drop_oldest(&mut self) {
        let excess = self.unsaved.len().saturating_sub(MAX_UNSAVED);
        if excess > 0 {
            self.unsaved.drain(..excess);
            self.incomplete = true;
            self.status.lost += excess as u64;
        }
    }

    /// Says what is wrong with the journal.
    pub fn tell_problem(&mut self, problem: &dyn std::fmt::Display) {
        let problem = problem.to_string();
        if self.status.problem.as_ref() != Some(&problem) {
            tracing::error!("journal: {problem}; diagnosis continues, faults are not saved");
        }
        self.status.problem = Some(problem);
    }

    fn tell_success(&mut self, bytes: u64) {
        if self.status.problem.take().is_some() {
            tracing::info!("journal: writing again");
        }
        self.status.bytes = bytes;
    }
}

fn texts(records: Vec<JournalRecord>) -> Vec<String> {
    let text = |record: JournalRecord| {
        record.to_text().map_err(|error| tracing::error!("a record cannot be written: {error}"))
    };
    records.into_iter().filter_map(|record| text(record).ok()).collect()
}
