//! A disk: what the kernel has survives the process, what was waited for survives a loss of power.

use std::collections::VecDeque;

use process::{Disk, JournalRecord, WatchedSteps};
use vocabulary::FaultTransition;

/// The journal of a module, and the file that says how far it had watched.
#[derive(Debug, Default)]
pub(crate) struct SimulatedDisk {
    /// The file before the latest new one.
    pub(crate) older: Vec<String>,
    present: Vec<String>,
    /// So many records of the present file survive a loss of power.
    synced: usize,
    pub(crate) watch: Option<WatchedSteps>,
    is_open: bool,
    /// It refuses everything.
    pub(crate) is_full: bool,
}

impl SimulatedDisk {
    /// What a process reads that starts on it.
    pub(crate) fn records(&self) -> Vec<String> {
        self.older.iter().chain(&self.present).cloned().collect()
    }

    /// Does what was waited for hold this transition, or a later one of its component?
    pub(crate) fn has_synced(&self, transition: &FaultTransition) -> bool {
        let synced = self.older.iter().chain(self.present.iter().take(self.synced)).rev();
        let mut read = synced.filter_map(|text| JournalRecord::from_text(text));
        read.any(|record| match record {
            JournalRecord::Transition(one) => {
                one.component == transition.component && one.place() >= transition.place()
            }
            _ => false,
        })
    }

    /// The process that had it open is gone.
    pub(crate) fn process_ended(&mut self) {
        self.is_open = false;
    }

    /// The power is lost: what was not waited for is gone.
    pub(crate) fn lose_power(&mut self) {
        self.present.truncate(self.synced);
        self.is_open = false;
    }

    fn check(&self) -> Result<(), String> {
        if self.is_full { Err("no space left on device".to_owned()) } else { Ok(()) }
    }
}

impl Disk for SimulatedDisk {
    fn open(&mut self) -> Result<(Vec<String>, u64), String> {
        self.check()?;
        self.is_open = true;
        Ok((self.records(), 0))
    }

    fn close(&mut self) {
        self.is_open = false;
    }

    fn is_open(&self) -> bool {
        self.is_open
    }

    fn append(&mut self, records: &VecDeque<String>) -> Result<(), String> {
        self.check()?;
        self.present.extend(records.iter().cloned());
        Ok(())
    }

    fn sync(&mut self) -> Result<(), String> {
        self.check()?;
        self.synced = self.present.len();
        Ok(())
    }

    fn rotate(&mut self, records: Vec<String>) -> Result<(), String> {
        self.check()?;
        self.older = std::mem::replace(&mut self.present, records);
        self.synced = self.present.len();
        Ok(())
    }

    fn bytes(&self) -> u64 {
        self.present.iter().map(|record| record.len() as u64 + 10).sum()
    }

    fn write_watch(&mut self, watch: WatchedSteps) -> Result<(), String> {
        self.check()?;
        self.watch = Some(watch);
        Ok(())
    }
}
