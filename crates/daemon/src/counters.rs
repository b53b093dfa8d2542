//! Counters that several threads share: each is listed once, in the message that publishes it.

use parking_lot::Mutex;

/// The counters of a message, counted wherever something happens and read for the status.
#[derive(Debug, Default)]
pub(crate) struct SharedCounters<T>(Mutex<T>);

impl<T: Clone> SharedCounters<T> {
    /// Counts, as `shared.count(|counters| counters.received += 1)`.
    pub(crate) fn count(&self, count: impl FnOnce(&mut T)) {
        count(&mut self.0.lock());
    }

    pub(crate) fn read(&self) -> T {
        self.0.lock().clone()
    }
}
