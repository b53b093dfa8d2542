//! The latest heartbeat of the working loop.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

const NOT_YET: u64 = u64::MAX;
const OVER: u64 = u64::MAX - 1;

/// Written by the loop, read by its monitors.
#[derive(Debug)]
pub struct Pulse {
    start: Instant,
    /// The latest round \[ns since the start\], or that there is none.
    latest_ns: AtomicU64,
}

/// The latest heartbeat of a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// It has not begun.
    NotYet,
    /// Its age.
    Ago(Duration),
    /// It was asked to end, and has.
    Over,
}

impl Pulse {
    pub(super) fn new() -> Self {
        Self { start: Instant::now(), latest_ns: AtomicU64::new(NOT_YET) }
    }

    /// The loop made progress.
    pub(super) fn beat(&self, now: Instant) {
        let elapsed = now.saturating_duration_since(self.start);
        let elapsed_ns = u64::try_from(elapsed.as_nanos()).unwrap_or(u64::MAX);
        self.latest_ns.store(elapsed_ns.min(OVER - 1), Ordering::Relaxed);
    }

    /// The loop has ended.
    pub(super) fn end(&self) {
        self.latest_ns.store(OVER, Ordering::Relaxed);
    }

    /// The latest heartbeat.
    pub fn sign(&self, now: Instant) -> Sign {
        match self.latest_ns.load(Ordering::Relaxed) {
            NOT_YET => Sign::NotYet,
            OVER => Sign::Over,
            latest_ns => {
                let elapsed = now.saturating_duration_since(self.start);
                Sign::Ago(elapsed.saturating_sub(Duration::from_nanos(latest_ns)))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_heartbeat_is_as_old_as_the_latest_beat() {
        let pulse = Pulse::new();
        let second = Duration::from_secs(1);
        assert_eq!(pulse.sign(pulse.start + second), Sign::NotYet);
        pulse.beat(pulse.start + second);
        assert_eq!(pulse.sign(pulse.start + second), Sign::Ago(Duration::ZERO));
        assert_eq!(pulse.sign(pulse.start + 3 * second), Sign::Ago(2 * second));
        pulse.beat(pulse.start + 3 * second);
        assert_eq!(pulse.sign(pulse.start + 4 * second), Sign::Ago(second));
        assert_eq!(pulse.sign(pulse.start), Sign::Ago(Duration::ZERO), "no age is negative");
        pulse.end();
        assert_eq!(pulse.sign(pulse.start + 4 * second), Sign::Over);
    }
}
