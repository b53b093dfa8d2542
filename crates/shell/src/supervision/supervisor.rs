//! Decides what is sent to the service manager, and when.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use sd_notify::NotifyState;
use vocabulary::printable;

use super::STOPPING;
use super::notification::Notification;
use super::pulse::{Pulse, Sign};
use crate::logging::with_unreachable;

/// Heartbeats per watchdog timeout of the service manager: all but one may be lost or late.
const SIGNS: u32 = 4;

/// The connection to the service manager, if there is one.
#[derive(Debug)]
pub struct Supervisor {
    manager: Option<Notification>,
    watch: Option<Watchdog>,
    pulse: Arc<Pulse>,
}

/// The schedule of watchdog heartbeats.
#[derive(Debug)]
struct Watchdog {
    every: Duration,
    start: Instant,
    /// The time of the next heartbeat \[ns since the start\].
    due_ns: AtomicU64,
}

impl Supervisor {
    /// The service manager named in the environment. Without one, notifications are dropped.
    pub fn from_environment() -> Self {
        let manager = Notification::from_environment().unwrap_or_else(|error| {
            tracing::warn!("the service manager cannot be notified: {error}");
            None
        });
        Self::new(manager, sd_notify::watchdog_enabled())
    }

    fn new(manager: Option<Notification>, timeout: Option<Duration>) -> Self {
        let watched = timeout.filter(|_| manager.is_some());
        let watch = watched.map(|timeout| Watchdog::new(timeout / SIGNS));
        Self { manager, watch, pulse: Arc::new(Pulse::new()) }
    }

    /// The same progress, for other monitors.
    pub fn pulse(&self) -> Arc<Pulse> {
        Arc::clone(&self.pulse)
    }

    /// Reports readiness. The status must be one line, because a further line would be read as another state.
    pub fn ready(&self, status: &str) {
        self.tell(&[NotifyState::Ready, NotifyState::Status(&printable(status))]);
    }

    /// Reports the present status, and the configured endpoints that are not reached.
    pub fn status(&self, status: &str) {
        if self.manager.is_some() {
            let words = with_unreachable(status, ", ");
            self.tell(&[NotifyState::Status(&printable(&words))]);
        }
    }

    /// Records progress; only the working loop may call this. No heartbeat is sent while another thread hangs.
    pub fn progress(&self) {
        let now = Instant::now();
        self.pulse.beat(now);
        if self.watch.as_ref().is_some_and(|watch| watch.is_due(now))
            && matches!(self.pulse.sign(now), Sign::Ago(_))
        {
            self.tell(&[NotifyState::Watchdog]);
        }
    }

    /// Reports the start of shutdown.
    pub fn stopping(&self) {
        self.pulse.end();
        self.tell(&[NotifyState::Stopping, NotifyState::Status(STOPPING)]);
    }

    fn tell(&self, states: &[NotifyState<'_>]) {
        let Some(manager) = &self.manager else { return };
        if let Err(error) = manager.send(states) {
            tracing::debug!("the service manager was not notified: {error}");
        }
    }
}

impl Watchdog {
    fn new(every: Duration) -> Self {
        Self { every, start: Instant::now(), due_ns: AtomicU64::new(0) }
    }

    /// Whether a heartbeat is due; if so, schedules the next one.
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
    use super::*;

    #[test]
    fn progress_is_sent_at_once_and_then_four_times_within_the_timeout() {
        let watch = Watchdog::new(Duration::from_secs(2) / SIGNS);
        let sent = |after_ms| watch.is_due(watch.start + Duration::from_millis(after_ms));
        assert!(sent(0) && !sent(1) && !sent(499));
        assert!(sent(500) && !sent(501) && !sent(999));
        assert!(sent(1700) && !sent(2100) && sent(2200));
    }

    #[test]
    fn progress_is_sent_by_the_caller_only() {
        let (manager, notification) = Manager::new();
        let supervisor = Supervisor::new(Some(notification), Some(Duration::from_millis(4)));
        assert_eq!(manager.heard(), None);
        supervisor.progress();
        assert_eq!(manager.heard().as_deref(), Some("WATCHDOG=1\n"));
        let end = Instant::now() + Duration::from_millis(40);
        while Instant::now() < end {
            assert_eq!(manager.heard(), None, "no loop made progress");
        }
        supervisor.progress();
        assert_eq!(manager.heard().as_deref(), Some("WATCHDOG=1\n"));
    }

    #[test]
    fn without_a_watchdog_only_the_rest_is_sent() {
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
    fn a_status_is_one_line_whatever_it_quotes() {
        let (manager, notification) = Manager::new();
        let supervisor = Supervisor::new(Some(notification), None);
        supervisor.status("journal: disk\nSTOPPING=1");
        assert_eq!(manager.heard().as_deref(), Some("STATUS=journal: disk\\nSTOPPING=1\n"));
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
