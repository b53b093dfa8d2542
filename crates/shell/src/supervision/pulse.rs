//! The latest heartbeat of the working loop, and how long other threads have been at their present work.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use parking_lot::Mutex;

const NOT_YET: u64 = u64::MAX;
const OVER: u64 = u64::MAX - 1;
/// Marks a lane that is waiting for work.
const IDLE: u64 = u64::MAX;
/// A thread that takes this long for one piece of work is considered hung. The network may block it for a second, and a
/// long journal is read in one piece.
const HANGS_AFTER: Duration = Duration::from_secs(10);

/// Progress, written by the loop and read by monitors.
#[derive(Debug)]
pub struct Pulse {
    start: Instant,
    /// The time of the latest heartbeat \[ns since the start\], or a mark that there was none or the loop has ended.
    latest_ns: AtomicU64,
    lanes: Mutex<Vec<Lane>>,
}

/// The progress of another thread. It is considered hung if one piece of work takes too long; it may wait indefinitely.
#[derive(Debug, Clone)]
pub struct Lane {
    name: &'static str,
    start: Instant,
    /// The start of the present work \[ns since the start\], or [`IDLE`].
    busy_since_ns: Arc<AtomicU64>,
}

/// The state of a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// The loop has not started.
    NotYet,
    /// The age of the latest heartbeat.
    Ago(Duration),
    /// The loop runs, but another thread has been at one piece of work for this long.
    Stuck(&'static str, Duration),
    /// The loop was asked to end, and has ended.
    Over,
}

impl Pulse {
    pub(super) fn new() -> Self {
        let latest_ns = AtomicU64::new(NOT_YET);
        Self { start: Instant::now(), latest_ns, lanes: Mutex::default() }
    }

    /// Adds another thread, which is monitored while its lane exists.
    pub(super) fn lane(&self, name: &'static str) -> Lane {
        let lane = Lane { name, start: self.start, busy_since_ns: Arc::new(AtomicU64::new(IDLE)) };
        self.lanes.lock().push(lane.clone());
        lane
    }

    /// Records progress of the loop.
    pub(super) fn beat(&self, now: Instant) {
        self.latest_ns.store(since(self.start, now).min(OVER - 1), Ordering::Relaxed);
    }

    /// Records the end of the loop.
    pub(super) fn end(&self) {
        self.latest_ns.store(OVER, Ordering::Relaxed);
    }

    /// The state of the loop and of the other threads.
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
    /// Records the start of the next piece of work.
    pub fn begin(&self) {
        let now_ns = since(self.start, Instant::now()).min(IDLE - 1);
        self.busy_since_ns.store(now_ns, Ordering::Relaxed);
    }

    /// Records that the thread is waiting for work.
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
