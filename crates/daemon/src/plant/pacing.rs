//! When the next step may come.
//!
//! By the clock: step k is due k step lengths after step 0, whatever became of the steps between, so
//! the pace does not drift. Steps come in bursts, as data acquisition delivers them: all of a burst when
//! its last one is due, so that subscribers wake up once for several. Steps that come late are counted
//! and caught up at no more than twice the pace, so that catching up does not overrun subscribers. As fast as possible: never more than a window
//! ahead of the slowest diagnoser, so that nothing is dropped.

use std::sync::Arc;
use std::time::{Duration, Instant};

use vocabulary::Step;

use super::diagnosers::Diagnosers;
use super::source::SourceSettings;
use crate::config::{LockStep, Speed};

/// Longest sleep before it is checked whether the end was requested.
const GLANCE: Duration = Duration::from_millis(50);

/// How steps are paced.
#[derive(Debug)]
pub(crate) enum Pacing {
    /// By the clock.
    Clock(Metronome),
    /// By the diagnosers.
    LockStep {
        /// The diagnosers.
        diagnosers: Arc<Diagnosers>,
        /// How they are waited for.
        settings: LockStep,
    },
}

/// How late steps were.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Lateness {
    /// Steps that came more than a step's length too late.
    pub(crate) steps: u64,
    /// The worst delay.
    pub(crate) worst: Duration,
}

impl Pacing {
    pub(crate) fn new(settings: &SourceSettings, diagnosers: Arc<Diagnosers>) -> Self {
        let SourceSettings { step_s, burst_steps, lock_step, .. } = *settings;
        match settings.speed {
            Speed::Max => Pacing::LockStep { diagnosers, settings: lock_step },
            Speed::Factor(factor) => Pacing::Clock(Metronome::new(step_s / factor, burst_steps)),
        }
    }

    /// Are diagnosers waited for?
    pub(crate) fn is_lock_step(&self) -> bool {
        matches!(self, Pacing::LockStep { .. })
    }

    /// Waits until the step may be published.
    pub(crate) fn wait(&mut self, step: Step, stop: impl Fn() -> bool) {
        match self {
            Pacing::Clock(metronome) => {
                while let Some(remaining) = metronome.remaining(step, Instant::now()) {
                    if stop() {
                        return;
                    }
                    std::thread::sleep(remaining.min(GLANCE));
                }
                metronome.published(step, Instant::now());
            }
            Pacing::LockStep { diagnosers, settings } => {
                // All steps before this one must be done but for a window's length.
                let must_be_done = step.plus(1).minus(settings.window_steps);
                let timeout = Duration::from_millis(settings.timeout_ms);
                diagnosers.wait_until_done(must_be_done, timeout, stop);
            }
        }
    }

    pub(crate) fn lateness(&self) -> Lateness {
        match self {
            Pacing::Clock(metronome) => metronome.lateness,
            Pacing::LockStep { .. } => Lateness::default(),
        }
    }
}

/// Absolute deadlines on a monotonic clock.
#[derive(Debug)]
pub(crate) struct Metronome {
    period_s: f64,
    burst: u64,
    start: Option<(Step, Instant)>,
    latest: Option<Instant>,
    lateness: Lateness,
}

impl Metronome {
    fn new(period_s: f64, burst: u64) -> Self {
        let lateness = Lateness::default();
        Self { period_s, burst: burst.max(1), start: None, latest: None, lateness }
    }

    /// When the last step of the burst is due. Bursts end at the steps whose number is a multiple of the
    /// burst's length.
    fn deadline(&self, step: Step) -> Option<Instant> {
        let (first, start) = self.start?;
        let last = Step(step.0.div_ceil(self.burst).saturating_mul(self.burst));
        start.checked_add(self.length(last.since(first)))
    }

    /// The length of this many steps.
    fn length(&self, steps: u64) -> Duration {
        // Exact for as many steps as a run of years has.
        #[expect(clippy::cast_precision_loss, reason = "steps stay far below 2^53")]
        let length_s = steps as f64 * self.period_s;
        Duration::try_from_secs_f64(length_s).unwrap_or(Duration::MAX)
    }

    fn begins_burst(&self, step: Step) -> bool {
        step.0 % self.burst == 1 % self.burst
    }

    /// How long it is until the step may be published; `None` if that is now.
    fn remaining(&self, step: Step, now: Instant) -> Option<Duration> {
        if !self.begins_burst(step) && self.latest.is_some() {
            return None;
        }
        let due = self.deadline(step)?;
        let gentle = self.latest.map_or(due, |latest| latest + self.length(self.burst) / 2);
        let remaining = due.max(gentle).saturating_duration_since(now);
        (!remaining.is_zero()).then_some(remaining)
    }

    fn published(&mut self, step: Step, now: Instant) {
        let Some(due) = self.deadline(step) else {
            (self.start, self.latest) = (Some((step, now)), Some(now));
            return;
        };
        self.latest = Some(now);
        let late = now.saturating_duration_since(due);
        if late > self.length(1) {
            self.lateness.steps += 1;
        }
        self.lateness.worst = self.lateness.worst.max(late);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn deadlines_do_not_drift_whatever_the_steps_between_took() {
        let start = Instant::now();
        let mut metronome = Metronome::new(1e-3, 1);
        assert_eq!(metronome.remaining(Step(0), start), None);
        metronome.published(Step(0), start);
        metronome.published(Step(1), start + 3 * MS / 2);
        assert_eq!(metronome.remaining(Step(2), start + 3 * MS / 2), Some(MS / 2));
        assert_eq!(metronome.remaining(Step(3_600_000), start), Some(3_600_000 * MS));
        assert_eq!(metronome.lateness, Lateness { steps: 0, worst: MS / 2 });
    }

    #[test]
    fn late_steps_are_counted_and_caught_up_at_twice_the_pace() {
        let start = Instant::now();
        let mut metronome = Metronome::new(1e-3, 1);
        metronome.published(Step(0), start);
        let mut now = start + 10 * MS;
        let mut step = 1;
        while metronome.remaining(Step(step), now).is_none_or(|left| left <= MS / 2) {
            now += metronome.remaining(Step(step), now).unwrap_or_default();
            metronome.published(Step(step), now);
            step += 1;
        }
        // 10 ms late, half a millisecond gained with each step
        assert!((18..=20).contains(&step), "{step}");
        assert!(metronome.lateness.steps >= 15);
        assert_eq!(metronome.lateness.worst, 9 * MS);
    }
    #[test]
    fn a_burst_comes_when_its_last_step_is_due_and_the_pace_stays() {
        let start = Instant::now();
        let mut metronome = Metronome::new(1e-3, 4);
        metronome.published(Step(0), start);
        for burst in 0..100_u64 {
            let first = 4 * burst + 1;
            let due = start + Duration::from_millis(first + 3);
            assert_eq!(metronome.remaining(Step(first), due - 3 * MS), Some(3 * MS));
            for step in first..first + 4 {
                assert_eq!(metronome.remaining(Step(step), due), None);
                metronome.published(Step(step), due);
            }
        }
        assert_eq!(metronome.lateness, Lateness::default());
    }
}
