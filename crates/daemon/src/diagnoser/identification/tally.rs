//! What was identified and how long it took, for the metrics.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use parking_lot::Mutex;
use vocabulary::Identification;

use crate::metrics::{IdentificationReport, KindReport};

/// Shared by the thread that identifies, the one that publishes, and the diagnosis loop.
#[derive(Debug, Default)]
pub(crate) struct IdentificationTally {
    done: AtomicU64,
    nanoseconds: AtomicU64,
    turned_away: AtomicU64,
    failed: AtomicU64,
    published: AtomicU64,
    kinds: Mutex<Vec<KindReport>>,
}

impl IdentificationTally {
    /// One more, which took so long.
    pub(crate) fn done(&self, took: Duration) {
        let nanoseconds = u64::try_from(took.as_nanos()).unwrap_or(u64::MAX);
        self.nanoseconds.fetch_add(nanoseconds, Ordering::Relaxed);
        count(&self.done);
    }

    /// One for which there was no room.
    pub(crate) fn turned_away(&self) {
        count(&self.turned_away);
    }

    /// One that panicked.
    pub(crate) fn failed(&self) {
        count(&self.failed);
    }

    /// One that was published.
    pub(crate) fn published(&self) {
        count(&self.published);
    }

    /// What is known of all present faults.
    pub(crate) fn know<'a>(&self, latest: impl Iterator<Item = &'a Identification>) {
        let kinds = latest.flat_map(|identification| {
            identification.candidates.iter().map(|candidate| KindReport {
                component: identification.component.component.clone(),
                kind: candidate.kind.to_string(),
                probability: candidate.probability,
            })
        });
        let kinds = kinds.collect();
        *self.kinds.lock() = kinds;
    }

    pub(crate) fn read(&self) -> IdentificationReport {
        let read = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        IdentificationReport {
            done: read(&self.done),
            took: Duration::from_nanos(read(&self.nanoseconds)),
            turned_away: read(&self.turned_away),
            failed: read(&self.failed),
            published: read(&self.published),
            kinds: self.kinds.lock().clone(),
        }
    }
}

fn count(counter: &AtomicU64) {
    counter.fetch_add(1, Ordering::Relaxed);
}
