//! When a question to a module is put again.

use std::time::{Duration, Instant};

use vocabulary::delivery::Backoff;

/// Questions in a row that bring nothing, after which it is given up.
const ATTEMPTS: u32 = 3;
/// From one of them to the next.
const PAUSES: Backoff<Duration> =
    Backoff::new(Duration::from_millis(200), Duration::from_millis(400));
/// After it was given up, before it is tried again.
const REST: Duration = Duration::from_secs(10);

/// At most one question at a time, and none too soon after one that brought nothing.
#[derive(Debug)]
pub(super) struct Retries {
    asked: bool,
    pauses: Backoff<Duration>,
    not_before: Option<Instant>,
}

impl Default for Retries {
    fn default() -> Self {
        Self { asked: false, pauses: PAUSES, not_before: None }
    }
}

impl Retries {
    /// May a question be put now?
    pub(super) fn may_ask(&self, now: Instant) -> bool {
        !self.asked && self.not_before.is_none_or(|time| now >= time)
    }

    /// A question is put.
    pub(super) fn ask(&mut self) {
        self.asked = true;
    }

    /// It brought something.
    pub(super) fn succeed(&mut self) {
        *self = Self::default();
    }

    /// It brought nothing. Whether that is enough to give up.
    pub(super) fn fail(&mut self, now: Instant) -> bool {
        self.asked = false;
        let pause = self.pauses.fail();
        let is_over = self.pauses.failures() >= ATTEMPTS;
        if is_over {
            self.pauses.succeed();
        }
        self.not_before = Some(now + if is_over { REST } else { pause });
        is_over
    }

    /// Something else has changed: a question is worth it at once.
    pub(super) fn forgive(&mut self) {
        self.pauses.succeed();
        self.not_before = None;
    }
}
