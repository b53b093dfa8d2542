//! The open journal.
//!
//! What cannot be written (a full disk, a directory that is read-only) is kept and tried again. Where that gets too
//! much, the oldest of it is dropped, and what is written next is a new file with the present state.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use journal::{Journal, OpenError, Opened};
use shell::clock;
use vocabulary::{JournalStatus, ModuleName};

use super::recollection::Recollection;
use super::record::{Record, check_version};
use super::snapshot::Snapshot;
use super::watch_file::{Watch, WatchFile};

/// Records that may wait for a disk.
const MAX_UNSAVED: usize = 16_384;

/// A state directory that cannot be used at all.
#[derive(Debug, thiserror::Error)]
pub(crate) enum StateError {
    /// Another diagnoser of this module is running.
    #[error("{0}; another diagnoser of this module is running, or another directory is needed")]
    InUse(OpenError),
    /// The journal is not one that this version of the program can read.
    #[error(
        "the journal in {directory} was written by another version: {problem}; move it away or use another directory"
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
pub(crate) struct Keeper {
    directory: Option<PathBuf>,
    journal: Option<Journal>,
    /// What a journal holds that could not be opened at the start is not known.
    unread: bool,
    unsaved: VecDeque<String>,
    /// The disk may lack what was appended, or never got it: only a new file is certain to be whole.
    incomplete: bool,
    /// For the beginning of the next file.
    snapshot: Snapshot,
    rotate_bytes: u64,
    status: JournalStatus,
}

impl Keeper {
    /// Opens the journal in a directory, with what it holds. Without a directory nothing is kept.
    ///
    /// # Errors
    /// Another process has it open, or another version wrote it. Anything else that is wrong with it stands in the status.
    pub(crate) fn open(
        directory: Option<&Path>,
        rotate_bytes: u64,
        module: &ModuleName,
    ) -> Result<(Self, Recollection), StateError> {
        let directory_shown = directory.map(|directory| directory.display().to_string());
        let mut keeper = Self {
            directory: directory.map(Path::to_owned),
            journal: None,
            unread: false,
            unsaved: VecDeque::new(),
            incomplete: false,
            snapshot: Snapshot::default(),
            rotate_bytes,
            status: JournalStatus { directory: directory_shown, ..JournalStatus::default() },
        };
        let records = match keeper.try_open() {
            Ok(records) => records,
            Err(error @ OpenError::InUse { .. }) => return Err(StateError::InUse(error)),
            Err(error) => {
                keeper.tell_problem(&error);
                keeper.read_only()
            }
        };
        check_version(&records).map_err(|problem| {
            let directory = keeper.status.directory.clone().unwrap_or_default();
            StateError::OtherVersion { directory, problem }
        })?;
        let recollection = Recollection::of(&records, module);
        keeper.status.incarnation = incarnation(&records, module);
        keeper.snapshot.note_texts(records);
        Ok((keeper, recollection))
    }

    /// Opens the journal; returns what it holds.
    fn try_open(&mut self) -> Result<Vec<String>, OpenError> {
        let Some(directory) = &self.directory else { return Ok(Vec::new()) };
        let Opened { journal, records, damage } = Journal::open(directory)?;
        for damage in &damage {
            tracing::warn!("journal damaged, the rest is used: {damage}");
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
            let problem = "holds faults that could not be read at the start; restart to load them";
            return Err(problem.to_owned());
        }
        self.unread = false;
        Ok(())
    }

    /// How the journal is.
    pub(crate) fn status(&self) -> &JournalStatus {
        &self.status
    }

    /// Takes note of what was dropped before it came here, so that its present state is written all the same.
    pub(crate) fn make_up_for(&mut self, dropped: &Snapshot, count: u64) {
        if !dropped.is_empty() {
            self.snapshot.note_texts(dropped.texts().map(str::to_owned));
            self.incomplete = true;
        }
        self.status.lost += count;
    }

    /// Writes records and waits for the disk. Returns whether it has them; if not they are kept, and
    /// tried again with the next ones.
    pub(crate) fn save(&mut self, records: Vec<Record>) -> bool {
        for record in records {
            match record.to_text() {
                Ok(text) => {
                    self.unsaved.push_back(text.clone());
                    self.snapshot.note(record, text);
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
        self.status.unsaved = self.unsaved.len() as u64;
        saved
    }

    /// Is anything waiting for the disk?
    pub(crate) fn is_behind(&self) -> bool {
        self.directory.is_some() && (!self.unsaved.is_empty() || self.incomplete)
    }

    /// Has the disk everything that there is to be kept?
    pub(crate) fn is_up_to_date(&self) -> bool {
        self.directory.is_some() && !self.is_behind()
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
            // After a failure the kernel does not try again.
            let doubtful = std::mem::replace(&mut self.incomplete, true);
            if doubtful || journal.bytes() > self.rotate_bytes {
                journal.rotate(self.snapshot.texts())
            } else {
                journal.sync()
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
            tracing::error!("journal: {problem}; diagnosis goes on, faults are not kept");
        }
        self.status.problem = Some(problem);
    }

    fn tell_success(&mut self, bytes: u64) {
        if self.status.problem.take().is_some() {
            tracing::info!("journal: writing again");
        }
        self.status.bytes = bytes;
    }

    /// Opens the file that says how far the module had watched.
    pub(crate) fn open_watch_file(&mut self) -> Option<(WatchFile, Option<Watch>)> {
        let directory = self.directory.clone()?;
        WatchFile::open(&directory).map_err(|error| self.tell_problem(&error)).ok()
    }
}

/// What sequence numbers count in: that of the journal, or a new one.
fn incarnation(records: &[String], module: &ModuleName) -> u64 {
    let stated = records.iter().filter_map(|text| match Record::from_text(text)? {
        Record::Start { incarnation, .. } => Some(incarnation),
        Record::Transition(transition) if transition.module == *module => {
            Some(transition.incarnation)
        }
        _ => None,
    });
    stated.max().unwrap_or_else(|| clock::unix_ns() / 1_000_000)
}

#[cfg(test)]
mod tests {
    use super::*;
    use diagnosis::messages::Speaker;
    use vocabulary::{RunId, Step};

    fn change(step: u64) -> Record {
        let component = "sensor/g1".parse().unwrap();
        let change = vocabulary::Change::at(component, Step(step), 2.0);
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
        assert!(keeper.status().problem.is_some());
        assert!(!keeper.save(vec![change(1)]) && keeper.is_behind());
        assert_eq!(keeper.status().unsaved, 1);
        std::fs::remove_file(&state).unwrap();
        assert!(keeper.save(vec![change(2)]) && !keeper.is_behind());
        assert_eq!(keeper.status().problem, None);
        drop(keeper);
        assert_eq!(journal::read(&state).unwrap().count(), 2);
    }

    fn transition(sequence: u64) -> String {
        let speaker = Speaker::of("t".parse().unwrap(), "m1".parse().unwrap());
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
        assert!(keeper.save(vec![change(1)]) && keeper.save(vec![change(2)]));
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
        assert!(keeper.save(vec![record(latched), record(identification(3))]));
        // The first file becomes the older one, and is gone.
        assert!(keeper.save(vec![change(1)]) && keeper.save(vec![change(2)]));
        drop(keeper);
        let (mut keeper, recollection) = open();
        let published = |recollection: &Recollection| {
            recollection.faults.values().filter_map(|fault| fault.published().cloned()).count()
        };
        assert_eq!(published(&recollection), 1);
        assert!(keeper.save(vec![record(transition(4))]));
        let kept: Vec<&str> = keeper.snapshot.texts().collect();
        assert!(kept.iter().all(|text| !text.contains(r#""record":"identification""#)), "{kept:?}");
        drop(keeper);
        assert_eq!(published(&open().1), 0);
    }

    fn identification(sequence: u64) -> String {
        let speaker = Speaker::of("t".parse().unwrap(), "m1".parse().unwrap());
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
    fn the_latest_state_reaches_the_file_whatever_was_dropped_meanwhile() {
        let directory = tempfile::tempdir().unwrap();
        let state = directory.path().join("state");
        std::fs::write(&state, "in the way").unwrap();
        let (mut keeper, _) = open(&state);
        let latched = transition(3).replace("normal", "latched");
        assert!(!keeper.save(vec![Record::from_text(&latched).unwrap()]));
        for step in 0..=MAX_UNSAVED as u64 {
            assert!(!keeper.save(vec![change(step)]));
        }
        assert_eq!((keeper.status().lost, keeper.status().unsaved), (2, MAX_UNSAVED as u64));
        let mut dropped = Snapshot::default();
        dropped.note_texts([transition(7).replace("g1", "g2")]);
        keeper.make_up_for(&dropped, 1);
        std::fs::remove_file(&state).unwrap();
        assert!(keeper.save(Vec::new()) && !keeper.is_behind());
        assert_eq!(keeper.status().lost, 3);
        drop(keeper);
        let (_, recollection) = open(&state);
        let latest = recollection.latest.iter().map(|latest| latest.sequence);
        assert_eq!(latest.collect::<Vec<_>>(), [3, 7]);
    }

    #[test]
    fn a_count_has_one_incarnation_and_a_wiped_directory_begins_a_later_one() {
        let directory = tempfile::tempdir().unwrap();
        let first = open(directory.path()).0.status().incarnation;
        // A process that ended before it wrote anything has numbered nothing that was kept.
        while clock::unix_ns() / 1_000_000 <= first {}
        let (mut keeper, _) = open(directory.path());
        let begun = keeper.status().incarnation;
        assert!(begun > first);
        assert!(keeper.save(vec![start(begun)]));
        for step in 0..100 {
            assert!(keeper.save(vec![change(step)]));
        }
        drop(keeper);
        assert_eq!(open(directory.path()).0.status().incarnation, begun, "after new files too");
        while clock::unix_ns() / 1_000_000 <= begun {}
        let wiped = tempfile::tempdir().unwrap();
        assert!(open(wiped.path()).0.status().incarnation > begun);
    }

    fn start(incarnation: u64) -> Record {
        Record::Start { v: 1, software: "0.2.0".to_owned(), time_unix_ns: 5, incarnation }
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
            assert!(keeper.save(vec![change(step)]));
        }
        assert!(keeper.status().bytes < 20_000);
        drop(keeper);
        let (_, recollection) = open(directory.path());
        let watch = Watch { run: RunId(1), watched: None };
        assert_eq!(recollection.memory(Some(watch)).watch.unwrap().changes.len(), 100);
    }
}
