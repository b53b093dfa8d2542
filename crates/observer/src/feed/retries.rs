//! When a question to a module is put again.

use std::time::{Duration, Instant};

/// Questions in a row that bring nothing, after which it is given up.
const ATTEMPTS: u32 = 3;
/// From the first of them to the next; each time twice as long.
const PAUSE: Duration = Duration::from_millis(200);
/// After it was given up, before it is tried again.
const REST: Duration = Duration::from_secs(10);

/// At most one question at a time, and none too soon after one that brought nothing.
#[derive(Debug, Default)]
pub(super) struct Retries {
    asked: bool,
    in_vain: u32,
    not_before: Option<Instant>,
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
        self.in_vain += 1;
        let is_over = self.in_vain >= ATTEMPTS;
        let pause = if is_over { REST } else { PAUSE * (1 << (self.in_vain - 1)) };
        self.not_before = Some(now + pause);
        if is_over {
            self.in_vain = 0;
        }
        is_over
    }

    /// Something else has changed: a question is worth it at once.
    pub(super) fn forgive(&mut self) {
        self.in_vain = 0;
        self.not_before = None;
    }
}
