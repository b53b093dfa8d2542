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

/// How long a module that is away may take to come back before what it published is given up.
const RESTARTED_WITHIN: Duration = Duration::from_secs(10);

/// Allows one question at a time, and none too soon after a failure.
#[derive(Debug)]
pub(super) struct Retries {
    asked: bool,
    pauses: Backoff<Duration>,
    not_before: Option<Instant>,
    /// Until then failures do not count, because the module is away and may come back.
    away_until: Option<Instant>,
}

impl Default for Retries {
    fn default() -> Self {
        Self { asked: false, pauses: PAUSES, not_before: None, away_until: None }
    }
}

impl Retries {
    /// Whether a question may be asked now.
    pub(super) fn may_ask(&self, now: Instant) -> bool {
        let is_over = |time: Option<Instant>| time.is_none_or(|time| now >= time);
        !self.asked && is_over(self.not_before) && is_over(self.away_until)
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
        if self.away_until.is_some_and(|time| now < time) {
            return false;
        }
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
        (self.not_before, self.away_until) = (None, None);
    }

    /// The module is away: it is not asked until it is back, or has had time enough for a restart.
    pub(super) fn await_return(&mut self, now: Instant) {
        self.pauses.succeed();
        self.away_until = Some(now + RESTARTED_WITHIN);
    }
}
