//! What the service manager is told, and when.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use sd_notify::NotifyState;

use super::notification::Notification;
use super::pulse::Pulse;
use super::words;

/// Signs of progress within the time after which the service manager gives a process up: so many of
/// them may get lost or come late.
const SIGNS: u32 = 4;

/// The service manager, if there is one.
#[derive(Debug)]
pub(crate) struct Supervisor {
    manager: Option<Notification>,
    watch: Option<Watch>,
    pulse: Arc<Pulse>,
}

/// How often the service manager wants a sign of progress.
#[derive(Debug)]
struct Watch {
    every: Duration,
    start: Instant,
    /// When the next sign is due \[ns since the start\].
    due_ns: AtomicU64,
}

impl Supervisor {
    /// The one that the environment names. Without one, whatever it is told goes nowhere.
    pub(crate) fn from_environment() -> Self {
        let manager = Notification::from_environment().unwrap_or_else(|error| {
            tracing::warn!("the service manager cannot be told anything: {error}");
            None
        });
        Self::new(manager, sd_notify::watchdog_enabled())
    }

    fn new(manager: Option<Notification>, patience: Option<Duration>) -> Self {
        let watched = patience.filter(|_| manager.is_some());
        let watch = watched.map(|patience| Watch::new(patience / SIGNS));
        Self { manager, watch, pulse: Arc::new(Pulse::new()) }
    }

    /// The same progress for others to look at.
    pub(crate) fn pulse(&self) -> Arc<Pulse> {
        Arc::clone(&self.pulse)
    }

    /// Everything is there that others rely on.
    pub(crate) fn ready(&self, status: &str) {
        self.tell(&[NotifyState::Ready, NotifyState::Status(status)]);
    }

    /// How it is at present.
    pub(crate) fn status(&self, status: &str) {
        self.tell(&[NotifyState::Status(status)]);
    }

    /// Whoever does the work has come round its loop. To be called by nobody else.
    pub(crate) fn progress(&self) {
        let now = Instant::now();
        self.pulse.beat(now);
        if self.watch.as_ref().is_some_and(|watch| watch.is_due(now)) {
            self.tell(&[NotifyState::Watchdog]);
        }
    }

    /// The end has begun.
    pub(crate) fn stopping(&self) {
        self.pulse.end();
        self.tell(&[NotifyState::Stopping, NotifyState::Status(words::STOPPING)]);
    }

    fn tell(&self, states: &[NotifyState<'_>]) {
        let Some(manager) = &self.manager else { return };
        if let Err(error) = manager.send(states) {
            tracing::debug!("the service manager was not told: {error}");
        }
    }
}

impl Watch {
    fn new(every: Duration) -> Self {
        Self { every, start: Instant::now(), due_ns: AtomicU64::new(0) }
    }

    /// Is a sign due? Then it is no longer.
    fn is_due(&self, now: Instant) -> bool {
        let elapsed = now.saturating_duration_since(self.start);
        if nanoseconds(elapsed) < self.due_ns.load(Ordering::Relaxed) {
            return false;
        }
        self.due_ns.store(nanoseconds(elapsed + self.every), Ordering::Relaxed);
        true
    }
}

fn nanoseconds(span: Duration) -> u64 {
    u64::try_from(span.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::super::notification::testing::Manager;
    use super::super::pulse::Sign;
    use super::*;

    #[test]
    fn progress_is_told_at_once_and_then_four_times_within_the_patience() {
        let watch = Watch::new(Duration::from_secs(2) / SIGNS);
        let told = |after_ms| watch.is_due(watch.start + Duration::from_millis(after_ms));
        assert!(told(0) && !told(1) && !told(499));
        assert!(told(500) && !told(501) && !told(999));
        assert!(told(1700) && !told(2100) && told(2200));
    }

    #[test]
    fn progress_is_told_by_nobody_but_who_calls() {
        let (manager, notification) = Manager::new();
        let supervisor = Supervisor::new(Some(notification), Some(Duration::from_millis(4)));
        assert_eq!(manager.heard(), None);
        supervisor.progress();
        assert_eq!(manager.heard().as_deref(), Some("WATCHDOG=1\n"));
        let end = Instant::now() + Duration::from_millis(40);
        while Instant::now() < end {
            assert_eq!(manager.heard(), None, "nobody came round");
        }
        supervisor.progress();
        assert_eq!(manager.heard().as_deref(), Some("WATCHDOG=1\n"));
    }

    #[test]
    fn without_a_watchdog_only_the_rest_is_told() {
        let (manager, notification) = Manager::new();
        let supervisor = Supervisor::new(Some(notification), None);
        supervisor.progress();
        supervisor.ready("waiting");
        supervisor.stopping();
        assert_eq!(manager.heard().as_deref(), Some("READY=1\nSTATUS=waiting\n"));
        assert_eq!(manager.heard().as_deref(), Some("STOPPING=1\nSTATUS=stopping\n"));
        assert_eq!(manager.heard(), None);
    }

    #[test]
    fn without_a_manager_nothing_happens() {
        let supervisor = Supervisor::new(None, Some(Duration::from_secs(2)));
        assert!(supervisor.watch.is_none());
        let sign = || supervisor.pulse().sign(Instant::now());
        assert_eq!(sign(), Sign::NotYet);
        supervisor.progress();
        assert!(matches!(sign(), Sign::Ago(_)), "progress is seen all the same");
        supervisor.stopping();
        assert_eq!(sign(), Sign::Over);
        supervisor.status("in service");
    }
}
