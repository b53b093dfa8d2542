//! The open journal.
//!
//! What cannot be written (a full disk, a directory that is read-only) is kept and tried again; it is
//! published meanwhile, marked as not durable. Diagnosis never waits for the disk.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use journal::{Journal, OpenError, Opened};
use names::{ComponentPath, ModuleName};
use wire::{FaultTransition, Identification, JournalStatus};

use super::recollection::Recollection;
use super::record::Record;
use super::watch_file::{Watch, WatchFile};

/// Records that may wait for a disk.
const MAX_UNSAVED: usize = 16_384;
/// Changes that a new file begins with, besides the present state.
const CHANGES_IN_SNAPSHOT: usize = 512;

/// A state directory that cannot be used at all.
#[derive(Debug, thiserror::Error)]
pub(crate) enum StateError {
    /// Another diagnoser of this module is running.
    #[error("{0}; another diagnoser of this module is running, or another directory is needed")]
    InUse(OpenError),
}

/// The state of the journal, for the status.
#[derive(Debug, Clone, Default)]
pub(crate) struct Board(Arc<Mutex<JournalStatus>>);

impl Board {
    pub(crate) fn read(&self) -> JournalStatus {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn change(&self, change: impl FnOnce(&mut JournalStatus)) {
        change(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner));
    }
}

/// The latest transition of a component, or the latest word on its fault, as it stands in the journal.
#[derive(Debug)]
struct Latest {
    /// The module that wrote it. The recollection accepts its own module only.
    module: ModuleName,
    component: ComponentPath,
    sequence: u64,
    text: String,
}

impl Latest {
    fn is_of(&self, module: &ModuleName, component: &ComponentPath) -> bool {
        (&self.module, &self.component) == (module, component)
    }

    /// Takes the place of what is known of the component, unless that is of a later transition.
    fn take_place_in(self, known: &mut Vec<Latest>) {
        let place = known.iter().position(|one| one.is_of(&self.module, &self.component));
        if let Some(place) = place {
            if known[place].sequence > self.sequence {
                return;
            }
            known.remove(place);
        }
        known.push(self);
    }
}

/// The open journal, or what stands in for one that cannot be opened at present.
#[derive(Debug)]
pub(crate) struct Keeper {
    directory: Option<PathBuf>,
    journal: Option<Journal>,
    /// What a journal holds that could not be opened at the start is not known.
    unread: bool,
    unsaved: VecDeque<String>,
    /// The disk may lack what was appended.
    unsynced: bool,
    /// For the beginning of the next file: of each component the latest transition.
    present: Vec<Latest>,
    /// The same, of each component that is faulty, of what its fault is.
    identified: Vec<Latest>,
    changes: VecDeque<String>,
    rotate_bytes: u64,
    board: Board,
}

impl Keeper {
    /// Opens the journal in a directory, with what it holds. Without a directory nothing is kept.
    ///
    /// # Errors
    /// Another process has it open. Anything else that is wrong with it stands on the board.
    pub(crate) fn open(
        directory: Option<&Path>,
        rotate_bytes: u64,
        module: &ModuleName,
    ) -> Result<(Self, Recollection), StateError> {
        let board = Board::default();
        board.change(|status| status.directory = directory.map(|d| d.display().to_string()));
        let mut keeper = Self {
            directory: directory.map(Path::to_owned),
            journal: None,
            unread: false,
            unsaved: VecDeque::new(),
            unsynced: false,
            present: Vec::new(),
            identified: Vec::new(),
            changes: VecDeque::new(),
            rotate_bytes,
            board,
        };
        let records = match keeper.try_open() {
            Ok(records) => records,
            Err(error @ OpenError::InUse { .. }) => return Err(StateError::InUse(error)),
            Err(error) => {
                keeper.tell_problem(&error);
                keeper.read_only()
            }
        };
        let recollection = Recollection::of(&records, module);
        keeper.remember(&records);
        Ok((keeper, recollection))
    }

    /// Opens the journal; returns what it holds.
    fn try_open(&mut self) -> Result<Vec<String>, OpenError> {
        let Some(directory) = &self.directory else { return Ok(Vec::new()) };
        let Opened { journal, records, damage } = Journal::open(directory)?;
        for damage in &damage {
            tracing::warn!("journal damaged, the rest is used: {damage}");
        }
        self.board.change(|status| {
            status.damaged = damage.len() as u64;
            status.bytes = journal.bytes();
        });
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
            let problem = "holds faults that could not be read at the start; restart to load them";
            return Err(problem.to_owned());
        }
        self.unread = false;
        Ok(())
    }

    /// How the journal is.
    pub(crate) fn board(&self) -> Board {
        self.board.clone()
    }

    /// Writes records and waits for the disk. Returns whether it has them; if not they are kept, and
    /// tried again with the next ones.
    pub(crate) fn save(&mut self, records: &[Record]) -> bool {
        for record in records {
            match record.to_text() {
                Ok(text) => {
                    self.remember(std::slice::from_ref(&text));
                    self.unsaved.push_back(text);
                }
                Err(error) => tracing::error!("a record cannot be written: {error}"),
            }
        }
        if self.directory.is_none() {
            self.unsaved.clear();
            return false;
        }
        let saved = self.flush();
        self.drop_oldest();
        self.board.change(|status| status.unsaved = self.unsaved.len() as u64);
        saved
    }

    /// Is anything waiting for the disk?
    pub(crate) fn is_behind(&self) -> bool {
        self.directory.is_some() && (!self.unsaved.is_empty() || self.unsynced)
    }

    fn flush(&mut self) -> bool {
        if self.journal.is_none()
            && let Err(problem) = self.open_at_last()
        {
            self.tell_problem(&problem);
        }
        let Some(journal) = &mut self.journal else { return false };
        let outcome = journal.append_all(&self.unsaved).and_then(|()| {
            self.unsaved.clear();
            let doubtful = std::mem::replace(&mut self.unsynced, true);
            // After a failure the kernel does not try again; only a new file is certain to be whole.
            if doubtful || journal.bytes() > self.rotate_bytes {
                // What a fault is comes after the fault.
                let states = self.present.iter().chain(&self.identified);
                let states = states.map(|latest| latest.text.as_str());
                journal.rotate(self.changes.iter().map(String::as_str).chain(states))
            } else {
                journal.sync()
            }
        });
        match outcome {
            Ok(()) => {
                self.unsynced = false;
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

    /// Keeps what the next file must begin with.
    fn remember(&mut self, texts: &[String]) {
        for text in texts {
            match Record::from_text(text) {
                Some(Record::Transition(transition)) => self.remember_state(*transition, text),
                Some(Record::Identification(found)) => self.remember_kind(*found, text),
                Some(Record::Change { .. }) => {
                    if self.changes.len() == CHANGES_IN_SNAPSHOT {
                        self.changes.pop_front();
                    }
                    self.changes.push_back(text.clone());
                }
                None => {}
            }
        }
    }

    /// The number decides which transition is the latest, as it does in the recollection.
    fn remember_state(&mut self, transition: FaultTransition, text: &str) {
        let FaultTransition { module, component, sequence, state, .. } = transition;
        if !state.is_fault() {
            // What it says of a fault before this is over.
            let over =
                |known: &Latest| known.is_of(&module, &component) && known.sequence < sequence;
            self.identified.retain(|known| !over(known));
        }
        let latest = Latest { module, component, sequence, text: text.to_owned() };
        latest.take_place_in(&mut self.present);
    }

    fn remember_kind(&mut self, found: Identification, text: &str) {
        let Identification { module, component, sequence, .. } = found;
        let latest = Latest { module, component, sequence, text: text.to_owned() };
        latest.take_place_in(&mut self.identified);
    }

    fn drop_oldest(&mut self) {
        let excess = self.unsaved.len().saturating_sub(MAX_UNSAVED);
        if excess > 0 {
            self.unsaved.drain(..excess);
            self.board.change(|status| status.lost += excess as u64);
        }
    }

    fn tell_problem(&self, problem: &dyn std::fmt::Display) {
        let problem = problem.to_string();
        self.board.change(|status| {
            if status.problem.as_ref() != Some(&problem) {
                tracing::error!("journal: {problem}; diagnosis goes on, faults are not kept");
            }
            status.problem = Some(problem);
        });
    }

    fn tell_success(&self, bytes: u64) {
        self.board.change(|status| {
            if status.problem.take().is_some() {
                tracing::info!("journal: writing again");
            }
            status.bytes = bytes;
        });
    }

    /// Opens the file that says how far the module had watched.
    pub(crate) fn open_watch_file(&self) -> Option<(WatchFile, Option<Watch>)> {
        let directory = self.directory.as_ref()?;
        WatchFile::open(directory).map_err(|error| self.tell_problem(&error)).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::convert::Speaker;
    use names::{RunId, Step};

    fn change(step: u64) -> Record {
        let component = "sensor/g1".parse().unwrap();
        let change = wire::StateChange::at(component, Step(step), 2.0);
        Record::Change { run: RunId(1), change }
    }

    fn open(directory: &Path) -> (Keeper, Recollection) {
        Keeper::open(Some(directory), 1000, &"m1".parse().unwrap()).unwrap()
    }

    #[test]
    fn what_cannot_be_written_is_kept_and_written_later() {
        let directory = tempfile::tempdir().unwrap();
        let state = directory.path().join("state");
        std::fs::write(&state, "in the way").unwrap();
        let (mut keeper, _) = open(&state);
        assert!(keeper.board().read().problem.is_some());
        assert!(!keeper.save(&[change(1)]) && keeper.is_behind());
        assert_eq!(keeper.board().read().unsaved, 1);
        std::fs::remove_file(&state).unwrap();
        assert!(keeper.save(&[change(2)]) && !keeper.is_behind());
        assert_eq!(keeper.board().read().problem, None);
        drop(keeper);
        assert_eq!(journal::read(&state).unwrap().count(), 2);
    }

    fn transition(sequence: u64) -> String {
        let speaker = Speaker { structure: "t".parse().unwrap(), module: "m1".parse().unwrap() };
        let mut message = speaker.untouched(&"sensor/g1".parse().unwrap(), 5);
        message.sequence = sequence;
        Record::Transition(Box::new(message)).to_text().unwrap()
    }

    #[test]
    fn whatever_the_order_of_its_records_a_rotated_journal_knows_the_same_latest_transition() {
        let directory = tempfile::tempdir().unwrap();
        let foreign = transition(6).replace(r#""module":"m1""#, r#""module":"m2""#);
        let records = [transition(3), transition(5), transition(4), foreign];
        Journal::open(directory.path()).unwrap().journal.append_all(records).unwrap();
        let module = "m1".parse().unwrap();
        let open = || Keeper::open(Some(directory.path()), 0, &module).unwrap();
        let latest = |recollection: &Recollection| {
            recollection.latest.iter().map(|latest| latest.sequence).collect::<Vec<_>>()
        };
        let (mut keeper, before) = open();
        assert_eq!(latest(&before), [5]);
        // The first file becomes the older one, and is gone.
        assert!(keeper.save(&[change(1)]) && keeper.save(&[change(2)]));
        drop(keeper);
        assert_eq!(latest(&open().1), [5]);
    }

    #[test]
    fn a_rotated_journal_knows_what_a_present_fault_is_and_forgets_that_of_a_reset_one() {
        let directory = tempfile::tempdir().unwrap();
        let module: ModuleName = "m1".parse().unwrap();
        let open = || Keeper::open(Some(directory.path()), 0, &module).unwrap();
        let record = |text: String| Record::from_text(&text).unwrap();
        let latched = transition(3).replace("normal", "latched");
        let (mut keeper, _) = open();
        assert!(keeper.save(&[record(latched), record(identification(3))]));
        // The first file becomes the older one, and is gone.
        assert!(keeper.save(&[change(1)]) && keeper.save(&[change(2)]));
        drop(keeper);
        let (mut keeper, recollection) = open();
        let published = |recollection: &Recollection| {
            recollection.faults.values().filter_map(|fault| fault.published().cloned()).count()
        };
        assert_eq!(published(&recollection), 1);
        assert!(keeper.save(&[record(transition(4))]));
        assert!(keeper.identified.is_empty());
        drop(keeper);
        assert_eq!(published(&open().1), 0);
    }

    fn identification(sequence: u64) -> String {
        let speaker = Speaker { structure: "t".parse().unwrap(), module: "m1".parse().unwrap() };
        let found = diagnosis::identification::Identification {
            run: RunId(1),
            sequence,
            component: "sensor/g1".parse().unwrap(),
            as_of: Step(9),
            candidates: Vec::new(),
            signature: Vec::new(),
        };
        Record::Identification(Box::new(speaker.identification(found, 0))).to_text().unwrap()
    }

    #[test]
    fn a_second_keeper_of_the_same_directory_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        let _first = open(directory.path());
        let second = Keeper::open(Some(directory.path()), 1000, &"m1".parse().unwrap());
        let error = second.err().unwrap().to_string();
        assert!(error.contains("in use by process"), "{error}");
    }

    #[test]
    fn a_new_file_begins_with_the_present_state() {
        let directory = tempfile::tempdir().unwrap();
        let (mut keeper, _) = open(directory.path());
        for step in 0..100 {
            assert!(keeper.save(&[change(step)]));
        }
        assert!(keeper.board().read().bytes < 20_000);
        drop(keeper);
        let (_, recollection) = open(directory.path());
        let watch = Watch { run: RunId(1), watched: None };
        assert_eq!(recollection.memory(Some(watch)).watch.unwrap().changes.len(), 100);
    }
}
