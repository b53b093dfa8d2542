//! Whether the module monitors its components, for the thread that answers queries: written by the diagnosis loop,
//! and believed only as long as that loop is live.

use std::sync::Arc;
use std::time::Instant;

use parking_lot::Mutex;
use shell::clock;
use shell::health::live;
use shell::supervision::{Pulse, Sign};
use vocabulary::{ModulePhase, Unknown};

/// Shared by the loop and those who answer.
#[derive(Debug, Clone)]
pub(crate) struct Service {
    pulse: Arc<Pulse>,
    lack: Arc<Mutex<Option<Unknown>>>,
}

impl Service {
    /// Out of service until the loop enters something else.
    pub(crate) fn new(pulse: Arc<Pulse>, reason: String) -> Self {
        let unknown = Unknown { since_unix_ns: clock::unix_ns(), reason };
        Self { pulse, lack: Arc::new(Mutex::new(Some(unknown))) }
    }

    /// The phase at present, and its reason. What lasts began when it was first entered.
    pub(crate) fn enter(&self, phase: ModulePhase, reason: String) {
        let mut lack = self.lack.lock();
        let since_unix_ns = lack.as_ref().map_or_else(clock::unix_ns, |lack| lack.since_unix_ns);
        *lack = (phase != ModulePhase::InService).then_some(Unknown { since_unix_ns, reason });
    }

    /// Since when and why nothing is known of the components, if so.
    pub(crate) fn unknown(&self) -> Option<Unknown> {
        let sign = self.pulse.sign(Instant::now());
        let liveness = live(sign);
        if liveness.well {
            return self.lack.lock().clone();
        }
        let age_ns = match sign {
            Sign::Ago(age) | Sign::Stuck(_, age) => {
                u64::try_from(age.as_nanos()).unwrap_or(u64::MAX)
            }
            Sign::NotYet | Sign::Over => 0,
        };
        let since_unix_ns = clock::unix_ns().saturating_sub(age_ns);
        Some(Unknown { since_unix_ns, reason: liveness.words })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shell::supervision::Supervisor;

    #[test]
    fn since_when_stays_and_the_reason_is_the_latest() {
        let supervisor = Supervisor::from_environment();
        let service = Service::new(supervisor.pulse(), "no sample has come yet".to_owned());
        assert_eq!(
            service.unknown().unwrap().reason,
            "opening a session",
            "the loop has not begun"
        );
        supervisor.progress();
        let first = service.unknown().unwrap();
        assert_eq!(first.reason, "no sample has come yet");
        service.enter(ModulePhase::Initialising, "too few samples".to_owned());
        let reason = "too few samples".to_owned();
        assert_eq!(service.unknown(), Some(Unknown { reason, ..first }));
        service.enter(ModulePhase::InService, String::new());
        assert_eq!(service.unknown(), None);
        service.enter(ModulePhase::Stale, "no sample for 500 ms".to_owned());
        assert_eq!(service.unknown().unwrap().reason, "no sample for 500 ms");
    }
}
