//! The latest heartbeat of the working loop, and how long the threads beside it have been at their present work.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use parking_lot::Mutex;

const NOT_YET: u64 = u64::MAX;
const OVER: u64 = u64::MAX - 1;
/// The lane waits for work.
const IDLE: u64 = u64::MAX;
/// A thread that has been at one piece of work for this long hangs. The network may hold one up for a second, and a
/// long journal is read in one.
const HANGS_AFTER: Duration = Duration::from_secs(10);

/// Written by the loop, read by its monitors.
#[derive(Debug)]
pub struct Pulse {
    start: Instant,
    /// The latest round \[ns since the start\], or that there is none.
    latest_ns: AtomicU64,
    lanes: Mutex<Vec<Lane>>,
}

/// A thread beside the loop. It hangs if one piece of work takes too long; it may wait for work as long as it likes.
#[derive(Debug, Clone)]
pub struct Lane {
    name: &'static str,
    start: Instant,
    /// When it took up what it is at \[ns since the start\], or that it is at nothing.
    busy_since_ns: Arc<AtomicU64>,
}

/// The latest heartbeat of a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// It has not begun.
    NotYet,
    /// Its age.
    Ago(Duration),
    /// It is there, but a thread beside it has been at one piece of work for this long.
    Stuck(&'static str, Duration),
    /// It was asked to end, and has.
    Over,
}

impl Pulse {
    pub(super) fn new() -> Self {
        let latest_ns = AtomicU64::new(NOT_YET);
        Self { start: Instant::now(), latest_ns, lanes: Mutex::default() }
    }

    /// Another thread, which counts as long as it lives.
    pub(super) fn lane(&self, name: &'static str) -> Lane {
        let lane = Lane { name, start: self.start, busy_since_ns: Arc::new(AtomicU64::new(IDLE)) };
        self.lanes.lock().push(lane.clone());
        lane
    }

    /// The loop made progress.
    pub(super) fn beat(&self, now: Instant) {
        self.latest_ns.store(since(self.start, now).min(OVER - 1), Ordering::Relaxed);
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
                if let Some(lane) =
                    self.lanes.lock().iter().find(|lane| lane.busy(now) >= HANGS_AFTER)
                {
                    return Sign::Stuck(lane.name, lane.busy(now));
                }
                let elapsed = now.saturating_duration_since(self.start);
                Sign::Ago(elapsed.saturating_sub(Duration::from_nanos(latest_ns)))
            }
        }
    }
}

impl Lane {
    /// The next piece of work begins.
    pub fn begin(&self) {
        let now_ns = since(self.start, Instant::now()).min(IDLE - 1);
        self.busy_since_ns.store(now_ns, Ordering::Relaxed);
    }

    /// There is nothing to do.
    pub fn rest(&self) {
        self.busy_since_ns.store(IDLE, Ordering::Relaxed);
    }

    fn busy(&self, now: Instant) -> Duration {
        match self.busy_since_ns.load(Ordering::Relaxed) {
            IDLE => Duration::ZERO,
            began_ns => Duration::from_nanos(since(self.start, now).saturating_sub(began_ns)),
        }
    }
}

fn since(start: Instant, now: Instant) -> u64 {
    u64::try_from(now.saturating_duration_since(start).as_nanos()).unwrap_or(u64::MAX)
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

    #[test]
    fn a_thread_hangs_at_its_work_and_not_while_it_waits_for_some() {
        let pulse = Pulse::new();
        let lane = pulse.lane("events");
        let sign = || {
            let now = Instant::now() + HANGS_AFTER;
            pulse.beat(now);
            pulse.sign(now)
        };
        assert_eq!(sign(), Sign::Ago(Duration::ZERO));
        lane.begin();
        assert!(matches!(sign(), Sign::Stuck("events", age) if age >= HANGS_AFTER), "{:?}", sign());
        lane.rest();
        assert_eq!(sign(), Sign::Ago(Duration::ZERO));
    }
}
