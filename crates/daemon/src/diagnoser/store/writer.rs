//! The journal on disk and the thread that writes it. What is written when is decided by [`JournalKeeper`].

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::time::Duration;

use journal::{Journal, OpenError, Opened};
use process::{ComponentStore, Disk, JournalKeeper, JournalRecord, WatchedSteps, check_version};
use shell::clock;
use vocabulary::ModuleName;

use super::ModuleStore;
use super::watch_file::WatchFile;

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

/// The files of a state directory, as far as they can be opened at present.
#[derive(Debug)]
pub(super) struct StateFiles {
    pub(super) directory: Option<PathBuf>,
    pub(super) journal: Option<Journal>,
    watch: Option<WatchFile>,
}

impl StateFiles {
    /// Opens the journal; returns what it holds, and how many records are damaged.
    fn try_open(&mut self) -> Result<(Vec<String>, u64), OpenError> {
        let Some(directory) = &self.directory else { return Ok((Vec::new(), 0)) };
        let Opened { journal, records, damage } = Journal::open(directory)?;
        for damage in &damage {
            tracing::warn!("journal damaged, damaged records skipped: {damage}");
        }
        self.journal = Some(journal);
        Ok((records, damage.len() as u64))
    }

    /// What a journal holds that can be read but not written.
    fn read_only(&self) -> Result<Vec<String>, OpenError> {
        let Some(directory) = &self.directory else { return Ok(Vec::new()) };
        journal::read(directory).and_then(Iterator::collect)
    }

    /// Opens the file that says how far the module had watched.
    fn open_watch(&mut self) -> std::io::Result<Option<WatchedSteps>> {
        let Some(directory) = &self.directory else { return Ok(None) };
        let (file, watch) = WatchFile::open(directory)?;
        self.watch = Some(file);
        Ok(watch)
    }

    fn open_journal(&mut self) -> Result<&mut Journal, String> {
        self.journal.as_mut().ok_or_else(|| "it is not open".to_owned())
    }
}

impl Disk for StateFiles {
    fn open(&mut self) -> Result<(Vec<String>, u64), String> {
        let opened = self.try_open().map_err(|error| error.to_string())?;
        if self.watch.is_none() {
            // How far an earlier process had watched is of no use any more.
            self.open_watch().map_err(|error| error.to_string())?;
        }
        Ok(opened)
    }

    fn close(&mut self) {
        self.journal = None;
    }

    fn is_open(&self) -> bool {
        self.journal.is_some()
    }

    fn append(&mut self, records: &VecDeque<String>) -> Result<(), String> {
        self.open_journal()?.append_all(records).map_err(|error| error.to_string())
    }

    fn sync(&mut self) -> Result<(), String> {
        self.open_journal()?.sync().map_err(|error| error.to_string())
    }

    fn rotate(&mut self, records: Vec<String>) -> Result<(), String> {
        self.open_journal()?.rotate(records).map_err(|error| error.to_string())
    }

    fn bytes(&self) -> u64 {
        self.journal.as_ref().map_or(0, Journal::bytes)
    }

    fn write_watch(&mut self, watch: WatchedSteps) -> Result<(), String> {
        let file = self.watch.as_mut().ok_or("it is not open")?;
        file.write(watch).map_err(|error| error.to_string())
    }
}

/// What writes the journal.
#[derive(Debug)]
pub(crate) struct JournalWriter {
    pub(super) files: StateFiles,
    keeper: JournalKeeper,
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
        let keeper = &mut writer.keeper;
        let records = match writer.files.try_open() {
            Ok((records, damaged)) => {
                keeper.status.damaged = damaged;
                keeper.status.bytes = writer.files.bytes();
                records
            }
            Err(error @ OpenError::InUse { .. }) => return Err(StateError::InUse(error)),
            Err(error) => {
                keeper.tell_problem(&error);
                let records = writer.files.read_only();
                keeper.is_unread = records.is_err();
                records.unwrap_or_default()
            }
        };
        check_version(&records).map_err(|problem| {
            let directory = keeper.status.directory.clone().unwrap_or_default();
            StateError::OtherVersion { directory, problem }
        })?;
        let records = records.iter().filter_map(|text| JournalRecord::from_text(text)).collect();
        let watch = writer.files.open_watch().unwrap_or_else(|error| {
            keeper.tell_problem(&error);
            None
        });
        let store = writer.store(records, module);
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
        writer.keeper.is_unread = true;
        writer.keeper.tell_problem(&"the disk did not answer at the start");
        let store = writer.store(Vec::new(), module);
        (writer, store)
    }

    fn unopened(directory: Option<&Path>, rotate_bytes: u64) -> Self {
        let shown = directory.map(|directory| directory.display().to_string());
        let directory = directory.map(Path::to_owned);
        Self {
            files: StateFiles { directory, journal: None, watch: None },
            keeper: JournalKeeper::new(shown, rotate_bytes),
        }
    }

    fn store(&mut self, records: Vec<JournalRecord>, module: &ModuleName) -> ModuleStore {
        let components = ComponentStore::restore(records, module, clock::unix_ns());
        self.keeper.status.incarnation = components.incarnation();
        ModuleStore::new(components, self.keeper.status.clone())
    }

    /// Hands in that a process begins to write here.
    pub(crate) fn note_start(&self, store: &ModuleStore) {
        store.record(self.keeper.start(clock::unix_ns()));
    }

    /// Writes until nothing more can come.
    pub(crate) fn run(mut self, store: &ModuleStore) {
        while self.write_next(store, self.keeper.retry()).is_some() {}
    }

    /// Writes what waits at present; returns whether the disk has it.
    pub(super) fn write_waiting(&mut self, store: &ModuleStore) -> bool {
        self.write_next(store, Some(Duration::ZERO)) == Some(true)
    }

    fn write_next(&mut self, store: &ModuleStore, retry: Option<Duration>) -> Option<bool> {
        let batch = store.take(retry, |state, now| self.keeper.take(state, &self.files, now))?;
        let durable = self.keeper.write(batch, &mut self.files);
        store.settle(durable, &self.keeper.status);
        Some(durable)
    }

    /// Writes how far the module has watched.
    ///
    /// # Errors
    /// It cannot be written.
    pub(super) fn write_watch(&mut self, watch: WatchedSteps) -> std::io::Result<()> {
        self.files.write_watch(watch).map_err(std::io::Error::other)
    }
}
