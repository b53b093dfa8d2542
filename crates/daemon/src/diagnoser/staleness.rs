//! Whether samples arrive: missing samples are not evidence of health.

use std::sync::Arc;
use std::time::{Duration, Instant};

use vocabulary::ModulePhase;

use super::intake::Refusals;

/// Why nothing is known right after the start.
pub(super) const NO_SAMPLE_YET: &str = "no sample has come yet";

/// Monitors sample arrival and changes of the phase.
#[derive(Debug)]
pub(crate) struct Staleness {
    stale_after: Duration,
    latest: Option<Instant>,
    stale: bool,
    published: Option<ModulePhase>,
    refusals: Arc<Refusals>,
}

impl Staleness {
    pub(crate) fn new(stale_after: Duration, refusals: Arc<Refusals>) -> Self {
        Self { stale_after, latest: None, stale: false, published: None, refusals }
    }

    /// A sample was diagnosed.
    pub(crate) fn sample(&mut self, now: Instant) {
        self.latest = Some(now);
        self.stale = false;
    }

    /// Checks whether samples have stopped; returns whether they have just now.
    pub(crate) fn look(&mut self, now: Instant) -> bool {
        let silent =
            self.latest.is_some_and(|latest| now.duration_since(latest) >= self.stale_after);
        let begins = silent && !self.stale;
        self.stale = silent;
        begins
    }

    /// Have samples stopped?
    pub(crate) fn is_stale(&self) -> bool {
        self.stale
    }

    /// The phase as published.
    pub(crate) fn phase(&self, diagnosed: ModulePhase) -> ModulePhase {
        if self.stale { ModulePhase::Stale } else { diagnosed }
    }

    /// The phase published before, if `phase` differs from it; `phase` is then recorded as published.
    pub(crate) fn change_to(&mut self, phase: ModulePhase) -> Option<Option<ModulePhase>> {
        if self.published == Some(phase) {
            return None;
        }
        Some(self.published.replace(phase))
    }

    /// Why it is in this phase.
    pub(crate) fn reason(&self, phase: ModulePhase) -> String {
        let without_samples = matches!(phase, ModulePhase::Waiting | ModulePhase::Stale);
        let refused = self.refusals.present(Instant::now(), self.stale_after);
        if let Some(refused) = refused.filter(|_| without_samples) {
            return refused;
        }
        match phase {
            ModulePhase::Waiting => NO_SAMPLE_YET.to_owned(),
            ModulePhase::Initialising => {
                "a channel rests on too few samples, or samples are missing".to_owned()
            }
            ModulePhase::InService => "every channel with a signal is watched".to_owned(),
            ModulePhase::Stale => {
                format!("no sample for {} ms", self.stale_after.as_millis())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn silence_begins_once_and_ends_with_a_sample() {
        let limit = Duration::from_millis(500);
        let mut staleness = Staleness::new(limit, Arc::default());
        let start = Instant::now();
        assert!(
            !staleness.look(start + 10 * limit),
            "before the first sample it is waiting, not stale"
        );
        staleness.sample(start);
        assert!(!staleness.look(start + limit / 2));
        assert!(staleness.look(start + limit) && staleness.is_stale());
        assert!(!staleness.look(start + 2 * limit) && staleness.is_stale());
        assert_eq!(staleness.phase(ModulePhase::InService), ModulePhase::Stale);
        staleness.sample(start + 3 * limit);
        assert_eq!(staleness.phase(ModulePhase::InService), ModulePhase::InService);
    }

    #[test]
    fn a_phase_is_published_once() {
        let mut staleness = Staleness::new(Duration::from_millis(500), Arc::default());
        assert_eq!(staleness.change_to(ModulePhase::Waiting), Some(None));
        assert_eq!(staleness.change_to(ModulePhase::Waiting), None);
        assert_eq!(staleness.change_to(ModulePhase::Stale), Some(Some(ModulePhase::Waiting)));
    }
}
