//! Whether samples come at all: silence is not health.

use std::time::{Duration, Instant};

use wire::ModulePhase;

/// Watches for silence and for changes of the phase.
#[derive(Debug)]
pub(crate) struct Vigil {
    stale_after: Duration,
    latest: Option<Instant>,
    stale: bool,
    told: Option<ModulePhase>,
}

impl Vigil {
    pub(crate) fn new(stale_after: Duration) -> Self {
        Self { stale_after, latest: None, stale: false, told: None }
    }

    /// A sample was diagnosed.
    pub(crate) fn sample(&mut self, now: Instant) {
        self.latest = Some(now);
        self.stale = false;
    }

    /// Looks whether samples have stopped coming; whether they have just now.
    pub(crate) fn look(&mut self, now: Instant) -> bool {
        let silent =
            self.latest.is_some_and(|latest| now.duration_since(latest) >= self.stale_after);
        let begins = silent && !self.stale;
        self.stale = silent;
        begins
    }

    /// Have samples stopped coming?
    pub(crate) fn is_stale(&self) -> bool {
        self.stale
    }

    /// The phase as others see it.
    pub(crate) fn phase(&self, diagnosed: ModulePhase) -> ModulePhase {
        if self.stale { ModulePhase::Stale } else { diagnosed }
    }

    /// The phase that was told last, if `phase` is another one; then it is told now.
    pub(crate) fn tell(&mut self, phase: ModulePhase) -> Option<Option<ModulePhase>> {
        if self.told == Some(phase) {
            return None;
        }
        Some(self.told.replace(phase))
    }

    /// Why it is in this phase.
    pub(crate) fn reason(&self, phase: ModulePhase) -> String {
        match phase {
            ModulePhase::Waiting => "no sample has come yet".to_owned(),
            ModulePhase::Initialising => {
                "a channel rests on too few samples, or samples are missing".to_owned()
            }
            ModulePhase::InService => "every channel is watched".to_owned(),
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
        let mut vigil = Vigil::new(limit);
        let start = Instant::now();
        assert!(
            !vigil.look(start + 10 * limit),
            "before the first sample it is waiting, not stale"
        );
        vigil.sample(start);
        assert!(!vigil.look(start + limit / 2));
        assert!(vigil.look(start + limit) && vigil.is_stale());
        assert!(!vigil.look(start + 2 * limit) && vigil.is_stale());
        assert_eq!(vigil.phase(ModulePhase::InService), ModulePhase::Stale);
        vigil.sample(start + 3 * limit);
        assert_eq!(vigil.phase(ModulePhase::InService), ModulePhase::InService);
    }

    #[test]
    fn a_phase_is_told_once() {
        let mut vigil = Vigil::new(Duration::from_millis(500));
        assert_eq!(vigil.tell(ModulePhase::Waiting), Some(None));
        assert_eq!(vigil.tell(ModulePhase::Waiting), None);
        assert_eq!(vigil.tell(ModulePhase::Stale), Some(Some(ModulePhase::Waiting)));
    }
}
