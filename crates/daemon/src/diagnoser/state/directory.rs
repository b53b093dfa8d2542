//! A state directory opened outside a diagnoser, for tests of what is read from its files.

use std::path::Path;

use diagnosis::Memory;
use vocabulary::{Change, ModuleName, RunId, Step};

use super::{Keeper, Recollection, Record, Watch, WatchFile};

/// A state directory, open as a diagnoser has it open.
#[derive(Debug)]
pub struct StateDirectory {
    keeper: Keeper,
    recollection: Recollection,
    watch_file: Option<(WatchFile, Option<Watch>)>,
}

impl StateDirectory {
    /// Opens a module's state directory, and creates it if need be. A new file of the journal is begun
    /// when the present one has got larger than `rotate_bytes`.
    ///
    /// # Errors
    /// Another process has it open.
    pub fn open(directory: &Path, rotate_bytes: u64, module: &ModuleName) -> Result<Self, String> {
        let (mut keeper, recollection) = Keeper::open(Some(directory), rotate_bytes, module)
            .map_err(|error| error.to_string())?;
        let watch_file = keeper.open_watch_file();
        Ok(Self { keeper, recollection, watch_file })
    }

    /// What a diagnoser that starts on this directory knows of the time before.
    #[must_use]
    pub fn memory(&self) -> Memory {
        self.recollection.memory(self.watch_file.as_ref().and_then(|(_, watch)| *watch))
    }

    /// Writes down a change. Returns whether the disk has it.
    pub fn keep(&mut self, run: RunId, change: Change) -> bool {
        self.keeper.save(vec![Record::Change { run, change }])
    }

    /// Writes down from when to when every channel was watched.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn note_watch(&mut self, run: RunId, watched: Option<(Step, Step)>) -> std::io::Result<()> {
        match &mut self.watch_file {
            Some((file, _)) => file.write(Watch { run, watched }),
            None => Err(std::io::ErrorKind::NotFound.into()),
        }
    }
}
