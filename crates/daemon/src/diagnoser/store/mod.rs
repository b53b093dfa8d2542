//! The one store ([`StoreState`]), under one lock. The journal, replies, status, metrics and restarts come from it.
//!
//! The lock is held only to read or change it, never while the disk or the network is waited for.

mod watch_file;
mod writer;

use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use diagnosis::Memory;
use process::{ComponentStore, JournalRecord, StoreState, WatchedSteps};
use vocabulary::{Change, JournalStatus, ModuleName, RunId, Step};

pub(crate) use writer::JournalWriter;

/// A handle of the store. Its lock is the standard library's: a thread that panics while it wakes up leaves it usable,
/// where `parking_lot` could hold up every lock of the process. Each change under it is complete, so what a panic
/// left is used: the process ends in order.
#[derive(Debug, Clone)]
pub(crate) struct ModuleStore(Arc<SharedStore>);

#[derive(Debug)]
struct SharedStore {
    state: Mutex<StoreState>,
    /// There is something to be written, or there will not be any more.
    handed_in: Condvar,
    /// The disk has answered.
    answered: Condvar,
}

impl ModuleStore {
    pub(crate) fn new(components: ComponentStore, status: JournalStatus) -> Self {
        let state = StoreState::new(components, status);
        let (handed_in, answered) = (Condvar::new(), Condvar::new());
        Self(Arc::new(SharedStore { state: Mutex::new(state), handed_in, answered }))
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, StoreState> {
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Ends a change; what of it is to be written is written.
    pub(crate) fn unlock(&self, state: MutexGuard<'_, StoreState>) {
        if !state.writes.is_empty() {
            self.0.handed_in.notify_one();
        }
    }

    /// Takes what is written to the journal and concerns no single component.
    pub(crate) fn record(&self, record: JournalRecord) {
        let mut state = self.lock();
        state.record(record, Instant::now());
        self.unlock(state);
    }

    /// Nothing will be handed in any more: the writing thread ends when everything is written.
    pub(crate) fn close(&self) {
        self.lock().is_closed = true;
        self.0.handed_in.notify_one();
    }

    /// Waits until the disk has answered for everything that was handed in by the time of a ticket, unless it hangs.
    /// Returns whether it has all of it.
    pub(crate) fn wait_for(&self, ticket: u64) -> bool {
        let mut state = self.lock();
        loop {
            let now = Instant::now();
            if let Some(durable) = state.writes.answer(ticket, now) {
                if let Some(limit) = state.writes.note_hang(ticket) {
                    tracing::error!(
                        "journal: disk not responding for {limit:?}; publishing unsaved faults, \
                         which a restart would lose"
                    );
                }
                return durable;
            }
            let left = state.writes.left(now);
            let woken = self.0.answered.wait_timeout(state, left);
            state = woken.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// What there is to be written, waited for; after `retry` at the latest, if that is given. `None` when nothing more
    /// will come.
    fn take<T>(
        &self,
        retry: Option<Duration>,
        take: impl FnOnce(&mut StoreState, Instant) -> T,
    ) -> Option<T> {
        let mut state = self.lock();
        let end = retry.map(|retry| Instant::now() + retry);
        while state.writes.is_empty() {
            if state.is_closed {
                return None;
            }
            let left = end.map(|end| end.saturating_duration_since(Instant::now()));
            match left {
                Some(left) if left.is_zero() => break,
                Some(left) => {
                    let woken = self.0.handed_in.wait_timeout(state, left);
                    state = woken.unwrap_or_else(PoisonError::into_inner).0;
                }
                None => {
                    let woken = self.0.handed_in.wait(state);
                    state = woken.unwrap_or_else(PoisonError::into_inner);
                }
            }
        }
        Some(take(&mut state, Instant::now()))
    }

    /// The disk has answered: whether it has everything so far, and how the journal is.
    fn settle(&self, durable: bool, status: &JournalStatus) {
        let hung = self.lock().writes.settle(durable, status.clone(), Instant::now());
        if let Some(hung) = hung {
            tracing::info!("journal: disk responding again after {:.1} s", hung.as_secs_f64());
        }
        self.0.answered.notify_all();
    }
}

/// A state directory opened without a diagnoser, to test reading its files.
#[derive(Debug)]
pub struct StateDirectory {
    writer: JournalWriter,
    store: ModuleStore,
    module: ModuleName,
    watch: Option<WatchedSteps>,
}

impl StateDirectory {
    /// Opens a module's state directory, and creates it if need be. A new file of the journal is begun
    /// when the present one has got larger than `rotate_bytes`.
    ///
    /// # Errors
    /// Another process has it open.
    pub fn open(directory: &Path, rotate_bytes: u64, module: &ModuleName) -> Result<Self, String> {
        let (writer, store, watch) = JournalWriter::open(Some(directory), rotate_bytes, module)
            .map_err(|error| error.to_string())?;
        Ok(Self { writer, store, module: module.clone(), watch })
    }

    /// What a diagnoser that starts on this directory knows of the time before.
    #[must_use]
    pub fn memory(&self) -> Memory {
        self.store.lock().components.memory(&self.module, self.watch)
    }

    /// Writes down a change. Returns whether the disk has it.
    pub fn keep(&mut self, run: RunId, change: Change) -> bool {
        self.store.record(JournalRecord::Change { run, change });
        self.writer.write_waiting(&self.store)
    }

    /// Writes down from when to when every channel was watched.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn note_watch(&mut self, run: RunId, watched: Option<(Step, Step)>) -> std::io::Result<()> {
        self.writer.write_watch(WatchedSteps { run, watched })
    }
}

#[cfg(test)]
mod tests;
