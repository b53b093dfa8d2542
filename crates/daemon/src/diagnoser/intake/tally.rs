//! What was counted on the way in, and whose samples come in.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use parking_lot::{Mutex, MutexGuard};
use shell::occurrences::Occurrences;
use vocabulary::{DecodeError, IntakeCounters};

use super::incumbent::Source;

/// IntakeTally of the samples.
#[derive(Debug, Default)]
pub(crate) struct IntakeTally {
    pub(super) received: AtomicU64,
    pub(super) dropped: AtomicU64,
    malformed: Refused,
    unknown_version: Refused,
    wrong_message: Refused,
    pub(super) other_module: Refused,
    pub(super) other_source: Refused,
    clock_standing: AtomicU64,
    pub(super) recovered: AtomicU64,
    pub(super) recoveries_failed: AtomicU64,
    resynchronised: AtomicU64,
    silences: AtomicU64,
    /// Whose samples are used at present.
    source: Mutex<Option<Source>>,
}

impl IntakeTally {
    pub(crate) fn read(&self) -> IntakeCounters {
        let read = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        IntakeCounters {
            received: read(&self.received),
            dropped: read(&self.dropped),
            malformed: read(&self.malformed.times),
            unknown_version: read(&self.unknown_version.times),
            wrong_message: read(&self.wrong_message.times),
            other_module: read(&self.other_module.times),
            other_source: read(&self.other_source.times),
            clock_standing: read(&self.clock_standing),
            recovered: read(&self.recovered),
            recoveries_failed: read(&self.recoveries_failed),
            resynchronised: read(&self.resynchronised),
            silences: read(&self.silences),
        }
    }

    /// The time of a sample was not later than that of the one before.
    pub(crate) fn note_standing_clock(&self) {
        count(&self.clock_standing);
    }

    /// Samples have stopped coming.
    pub(crate) fn note_silence(&self) {
        count(&self.silences);
    }

    /// A backlog was thrown away.
    pub(crate) fn resynchronise(&self, thrown: usize) {
        add(&self.dropped, thrown);
        count(&self.resynchronised);
    }

    pub(super) fn note_source(&self, source: Option<Source>) {
        *self.source() = source;
    }

    /// Are samples used that this one gives in reply to a query?
    pub(super) fn uses(&self, replier: Source) -> bool {
        self.source().is_some_and(|source| source.replies_as(replier))
    }

    /// Nothing can be left undone.
    fn source(&self) -> MutexGuard<'_, Option<Source>> {
        self.source.lock()
    }

    pub(super) fn of_error(&self, error: &DecodeError) -> &Refused {
        match error {
            DecodeError::TooLong { .. } | DecodeError::NotText | DecodeError::Malformed(_) => {
                &self.malformed
            }
            DecodeError::NoVersion | DecodeError::UnknownVersion(_) => &self.unknown_version,
            DecodeError::WrongMessage { .. } => &self.wrong_message,
        }
    }
}

/// Samples that were refused for reasons of one kind.
#[derive(Debug, Default)]
pub(super) struct Refused {
    times: AtomicU64,
    lines: Occurrences,
}

impl Refused {
    /// Counts one more, and logs it unless that was done a moment ago.
    pub(super) fn note(&self, problem: &str, now: Instant) {
        count(&self.times);
        if let Some(times) = self.lines.note(now) {
            tracing::warn!(times, "sample not used: {problem}");
        }
    }
}

/// Counts one more.
pub(super) fn count(counter: &AtomicU64) {
    counter.fetch_add(1, Ordering::Relaxed);
}

pub(super) fn add(counter: &AtomicU64, more: usize) {
    counter.fetch_add(more as u64, Ordering::Relaxed);
}
