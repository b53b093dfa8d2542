//! The journal on disk and the thread that writes it: records first, and when the disk has them, how far the module has
//! watched. So the watch never says more than the journal can prove.
//!
//! What cannot be written (a full disk, a directory that is read-only) is kept and tried again. Where that gets too
//! much, the oldest of it is dropped, and what is written next is a new file with the present state.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::time::Duration;

use journal::{Journal, OpenError, Opened};
use process::{ComponentStore, JOURNAL_VERSION, JournalRecord, WatchedSteps, check_version};
use shell::clock;
use vocabulary::{JournalStatus, ModuleName};

use super::ModuleStore;
use super::watch_file::WatchFile;

/// Records that may wait for a disk.
const MAX_UNSAVED: usize = 16_384;
/// How often a disk that refused is tried again.
const RETRY: Duration = Duration::from_secs(1);

/// A state directory that cannot be used at all.
#[derive(Debug, thiserror::Error)]
pub(crate) enum StateError {
    /// Another diagnoser of this module is running.
    #[error("{0}; stop the other diagnoser of this module, or use another directory")]
    InUse(OpenError),
    /// The journal is not one that this version of the program can read.
    #[error(
        "the journal in {directory} was written by another version: {problem}; move it or use another directory"
    )]
    OtherVersion {
        /// Where the journal is.
        directory: String,
        /// What is different.
        problem: String,
    },
}

/// The open journal, or what stands in for one that cannot be opened at present.
#[derive(Debug)]
pub(crate) struct JournalWriter {
    pub(super) directory: Option<PathBuf>,
    pub(super) journal: Option<Journal>,
    watch_file: Option<WatchFile>,
    /// What a journal holds that could not be opened at the start is not known.
    unread: bool,
    unsaved: VecDeque<String>,
    /// The disk may lack what was appended, or never got it: only a new file is certain to be whole.
    incomplete: bool,
    rotate_bytes: u64,
    status: JournalStatus,
}

impl JournalWriter {
    /// Opens the journal in a directory, with what it holds and how far the module had watched. Without a directory nothing
    /// is kept. A new file is begun when the present one has got larger than `rotate_bytes`.
    ///
    /// # Errors
    /// Another process has it open, or another version wrote it. Anything else that is wrong with it stands in the status.
    pub(crate) fn open(
        directory: Option<&Path>,
        rotate_bytes: u64,
        module: &ModuleName,
    ) -> Result<(Self, ModuleStore, Option<WatchedSteps>), StateError> {
        let mut writer = Self::unopened(directory, rotate_bytes);
        let records = match writer.try_open() {
            Ok(records) => records,
            Err(error @ OpenError::InUse { .. }) => return Err(StateError::InUse(error)),
            Err(error) => {
                writer.tell_problem(&error);
                writer.read_only()
            }
        };
        check_version(&records).map_err(|problem| {
            let directory = writer.status.directory.clone().unwrap_or_default();
            StateError::OtherVersion { directory, problem }
        })?;
        let records = records.iter().filter_map(|text| JournalRecord::from_text(text)).collect();
        let components = ComponentStore::restore(records, module, clock::unix_ns());
        writer.status.incarnation = components.incarnation();
        let watch = writer.open_watch_file();
        let store = ModuleStore::new(components, writer.status.clone());
        Ok((writer, store, watch))
    }

    /// The journal of a directory that does not answer at the start, and the store without what it may hold. It is opened
    /// when the disk answers.
    pub(crate) fn unanswered(
        directory: Option<&Path>,
        rotate_bytes: u64,
        module: &ModuleName,
    ) -> (Self, ModuleStore) {
        let mut writer = Self::unopened(directory, rotate_bytes);
        writer.unread = true;
        writer.tell_problem(&"the disk did not answer at the start");
        let components = ComponentStore::restore(Vec::new(), module, clock::unix_ns());
        writer.status.incarnation = components.incarnation();
        let store = ModuleStore::new(components, writer.status.clone());
        (writer, store)
    }

    fn unopened(directory: Option<&Path>, rotate_bytes: u64) -> Self {
        let shown = directory.map(|directory| directory.display().to_string());
        Self {
            directory: directory.map(Path::to_owned),
            journal: None,
            watch_file: None,
            unread: false,
            unsaved: VecDeque::new(),
            incomplete: false,
            rotate_bytes,
            status: JournalStatus { directory: shown, ..JournalStatus::default() },
        }
    }

    /// Opens the journal; returns what it holds.
    fn try_open(&mut self) -> Result<Vec<String>, OpenError> {
        let Some(directory) = &self.directory else { return Ok(Vec::new()) };
        let Opened { journal, records, damage } = Journal::open(directory)?;
        for damage in &damage {
            tracing::warn!("journal damaged, damaged records skipped: {damage}");
        }
        self.status.damaged = damage.len() as u64;
        self.status.bytes = journal.bytes();
        self.journal = Some(journal);
        Ok(records)
    }

    /// What a journal holds that can be read but not written.
    fn read_only(&mut self) -> Vec<String> {
        let Some(directory) = &self.directory else { return Vec::new() };
        let records = journal::read(directory).and_then(Iterator::collect::<Result<Vec<_>, _>>);
        records.unwrap_or_else(|_| {
            self.unread = true;
            Vec::new()
        })
    }

    /// Opens the journal that could not be opened at the start, unless it turns out to hold unknown
    /// faults: their numbers must not be given again.
    fn open_at_last(&mut self) -> Result<(), String> {
        let records = self.try_open().map_err(|error| error.to_string())?;
        if self.unread && !records.is_empty() {
            self.journal = None;
            let problem = "could not be read at startup; restart to load its faults";
            return Err(problem.to_owned());
        }
        self.unread = false;
        if self.watch_file.is_none() {
            // How far an earlier process had watched is of no use any more.
            self.open_watch_file();
        }
        Ok(())
    }

    /// Opens the file that says how far the module had watched.
    fn open_watch_file(&mut self) -> Option<WatchedSteps> {
        let directory = self.directory.clone()?;
        match WatchFile::open(&directory) {
            Ok((file, watch)) => {
                self.watch_file = Some(file);
                watch
            }
            Err(error) => {
                self.tell_problem(&error);
                None
            }
        }
    }

    /// Hands in that a process begins to write here: whether the disk takes anything shows before there is a fault.
    pub(crate) fn note_start(&self, store: &ModuleStore) {
        store.record(JournalRecord::Start {
            v: JOURNAL_VERSION,
            software: env!("CARGO_PKG_VERSION").to_owned(),
            time_unix_ns: clock::unix_ns(),
            incarnation: self.status.incarnation,
        });
    }

    /// Writes until nothing more can come.
    pub(crate) fn run(mut self, store: &ModuleStore) {
        while self.write_next(store, self.is_behind().then_some(RETRY)).is_some() {}
    }

    /// Writes what waits at present; returns whether the disk has it.
    pub(super) fn write_waiting(&mut self, store: &ModuleStore) -> bool {
        self.write_next(store, Some(Duration::ZERO)) == Some(true)
    }

    fn write_next(&mut self, store: &ModuleStore, retry: Option<Duration>) -> Option<bool> {
        let (batch, snapshot) = store.take(retry, self.is_new_file_due())?;
        self.status.lost += batch.dropped;
        self.incomplete |= batch.dropped > 0;
        let nothing_to_do = batch.records.is_empty() && self.is_up_to_date();
        let durable = nothing_to_do || self.save(batch.records, snapshot);
        if let Some(watch) = batch.watch.filter(|_| durable)
            && let Err(error) = self.write_watch(watch)
        {
            tracing::debug!("watch file: {error}");
        }
        store.settle(durable, &self.status);
        Some(durable)
    }

    /// Writes how far the module has watched.
    ///
    /// # Errors
    /// It cannot be written.
    pub(super) fn write_watch(&mut self, watch: WatchedSteps) -> std::io::Result<()> {
        let missing = std::io::ErrorKind::NotFound;
        self.watch_file.as_mut().ok_or(missing)?.write(watch)
    }

    /// Writes records and waits for the disk. Returns whether it has them; if not they are kept, and
    /// tried again with the next ones. `snapshot`: the present state, with which a new file begins.
    fn save(&mut self, records: Vec<JournalRecord>, snapshot: Option<Vec<JournalRecord>>) -> bool {
        self.unsaved.extend(texts(records));
        if self.directory.is_none() {
            self.unsaved.clear();
            return false;
        }
        let saved = self.flush(snapshot);
        self.drop_oldest();
        self.status.unsaved = self.unsaved.len() as u64;
        saved
    }

    /// Is anything waiting for the disk?
    fn is_behind(&self) -> bool {
        self.directory.is_some() && (!self.unsaved.is_empty() || self.incomplete)
    }

    /// Has the disk everything that there is to be kept?
    fn is_up_to_date(&self) -> bool {
        self.directory.is_some() && !self.is_behind()
    }

    /// After a failure the kernel does not try again, so that only a new file is certain to be whole.
    fn is_new_file_due(&self) -> bool {
        self.incomplete || self.journal.as_ref().is_some_and(|j| j.bytes() > self.rotate_bytes)
    }

    fn flush(&mut self, snapshot: Option<Vec<JournalRecord>>) -> bool {
        if self.journal.is_none()
            && let Err(problem) = self.open_at_last()
        {
            self.tell_problem(&problem);
        }
        let Some(journal) = &mut self.journal else { return false };
        let outcome = journal.append_all(&self.unsaved).and_then(|()| {
            self.unsaved.clear();
            self.incomplete = true;
            match snapshot {
                Some(snapshot) => journal.rotate(texts(snapshot)),
                None => journal.sync(),
            }
        });
        match outcome {
            Ok(()) => {
                self.incomplete = false;
                let bytes = journal.bytes();
                self.tell_success(bytes);
                true
            }
            Err(error) => {
                self.tell_problem(&error);
                false
            }
        }
    }

    fn drop_oldest(&mut self) {
        let excess = self.unsaved.len().saturating_sub(MAX_UNSAVED);
        if excess > 0 {
            self.unsaved.drain(..excess);
            self.incomplete = true;
            self.status.lost += excess as u64;
        }
    }

    fn tell_problem(&mut self, problem: &dyn std::fmt::Display) {
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
