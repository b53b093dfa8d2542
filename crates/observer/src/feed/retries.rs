//! Decides when to repeat a question to a module.

use std::time::{Duration, Instant};

use vocabulary::delivery::Backoff;

/// Consecutive failures after which a question is given up.
const ATTEMPTS: u32 = 3;
/// Pauses between attempts.
const PAUSES: Backoff<Duration> =
    Backoff::new(Duration::from_millis(200), Duration::from_millis(400));
/// Pause after giving up.
const REST: Duration = Duration::from_secs(10);

/// Allows one question at a time, and none too soon after a failure.
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
    /// Whether a question may be asked now.
    pub(super) fn may_ask(&self, now: Instant) -> bool {
        !self.asked && self.not_before.is_none_or(|time| now >= time)
    }

    /// A question is sent.
    pub(super) fn ask(&mut self) {
        self.asked = true;
    }

    /// The question was answered usefully.
    pub(super) fn succeed(&mut self) {
        *self = Self::default();
    }

    /// The question failed; returns whether to give up.
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

    /// Clears the failures: circumstances changed, so a question is worth sending at once.
    pub(super) fn forgive(&mut self) {
        self.pauses.succeed();
        self.not_before = None;
    }
}
