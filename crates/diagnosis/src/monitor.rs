//! The monitor of one channel: when does its divergence rise above the threshold, when is it quiet again?

use vocabulary::Step;

use crate::divergence::DivergenceOutcome;
use vocabulary::Evidence;

/// Time constant of the residual's slow mean, in times that a channel takes to be quiet: half a second of 40 ms.
const LEVEL_QUIETS: f64 = 12.5;

/// The onset of a change is traced back for as long as D stayed above this share of γ.
const ONSET_SHARE: f64 = 0.25;

/// What a channel did at a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Observation {
    /// Nothing new.
    Nothing,
    /// The divergence rose to its threshold; the residual has been changing since `onset`.
    Changed {
        /// First step of the unbroken rise.
        onset: Step,
    },
    /// The divergence has stayed below its threshold for long enough.
    Quiet,
}

/// The monitor of one channel: the rule by which a diagnoser detects changes. It takes every outcome
/// of the channel's divergence, in order; steps without one (a gap) are left out.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct Monitor {
    evidence: Evidence,
    warm_up_vectors: u64,
    quiet_steps: u64,
    watched: bool,
    rising_since: Option<Step>,
    active: bool,
    below_for: u64,
    /// The residual's slow mean, this step's residual included; `None` before the first.
    level: Option<f64>,
    /// The last step of the latest change.
    changed_until: Option<Step>,
}

impl Monitor {
    /// The monitor of a channel with threshold γ. A change counts once the channel's Gaussian has taken
    /// `warm_up_vectors`, and ends after `quiet_steps` consecutive steps below γ.
    #[must_use]
    pub fn new(threshold: f64, warm_up_vectors: u64, quiet_steps: u64) -> Self {
        let evidence =
            Evidence { step: Step(0), residual: 0.0, level: 0.0, divergence: None, threshold };
        Self {
            evidence,
            warm_up_vectors,
            quiet_steps,
            watched: false,
            rising_since: None,
            active: false,
            below_for: 0,
            level: None,
            changed_until: None,
        }
    }

    /// Forgets the past.
    pub fn restart(&mut self) {
        let threshold = self.evidence.threshold;
        *self = Self::new(threshold, self.warm_up_vectors, self.quiet_steps);
    }

    /// The channel is relearnt; a change that was not over goes on until the channel is seen to be quiet.
    pub fn relearn(&mut self) {
        self.watched = false;
        self.rising_since = None;
        self.below_for = 0;
        self.level = None;
    }

    /// The channel at the latest step.
    #[must_use]
    pub fn evidence(&self) -> &Evidence {
        &self.evidence
    }

    /// Does the channel's Gaussian rest on enough vectors?
    #[must_use]
    pub fn is_watched(&self) -> bool {
        self.watched
    }

    /// Has the channel changed and not become quiet since?
    #[must_use]
    pub fn is_active(&self) -> bool {
        self.active
    }

    /// The residual's slow mean at the latest step.
    #[must_use]
    pub fn level(&self) -> f64 {
        self.level.unwrap_or(0.0)
    }

    /// The last step at which the divergence was at its threshold or above, if it ever was.
    #[must_use]
    pub fn changed_until(&self) -> Option<Step> {
        self.changed_until
    }

    /// Takes the channel's next residual with what the estimator made of it.
    pub fn observe(
        &mut self,
        step: Step,
        residual: f64,
        outcome: DivergenceOutcome,
    ) -> Observation {
        let level = self.level.unwrap_or(residual);
        self.level = Some(level + (residual - level) / (LEVEL_QUIETS * self.quiet_steps as f64));
        let divergence = outcome.divergence();
        self.evidence = Evidence { step, residual, level, divergence, ..self.evidence };
        match outcome {
            DivergenceOutcome::Undefined => return Observation::Nothing,
            DivergenceOutcome::Restarted(_) => {
                self.watched = false;
                self.rising_since = None;
                return Observation::Nothing;
            }
            DivergenceOutcome::Defined { age, .. } => {
                self.watched = self.watched || age >= self.warm_up_vectors;
            }
        }
        if !self.watched {
            return Observation::Nothing;
        }
        self.judge(step)
    }

    fn judge(&mut self, step: Step) -> Observation {
        let ratio = self.evidence.ratio();
        self.rising_since = (ratio >= ONSET_SHARE).then(|| self.rising_since.unwrap_or(step));
        if ratio >= 1.0 {
            self.below_for = 0;
            self.changed_until = Some(step);
            if self.active {
                return Observation::Nothing;
            }
            self.active = true;
            return Observation::Changed { onset: self.rising_since.unwrap_or(step) };
        }
        if self.active {
            self.below_for += 1;
            if self.below_for >= self.quiet_steps {
                self.active = false;
                return Observation::Quiet;
            }
        }
        Observation::Nothing
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn observe(monitor: &mut Monitor, divergences: &[f64]) -> Vec<(usize, Observation)> {
        let observations = divergences.iter().enumerate().map(|(k, &divergence)| {
            let outcome = DivergenceOutcome::Defined { divergence, age: 10 };
            (k, monitor.observe(Step(k as u64), 0.0, outcome))
        });
        observations.filter(|(_, observation)| *observation != Observation::Nothing).collect()
    }

    #[test]
    fn a_change_is_reported_once_and_traced_back_to_its_onset() {
        let mut monitor = Monitor::new(2.0, 5, 3);
        let seen = observe(&mut monitor, &[0.1, 0.6, 0.8, 2.0, 5.0, 1.0, 3.0, 0.1, 0.1, 0.1, 0.1]);
        assert_eq!(seen, [(3, Observation::Changed { onset: Step(1) }), (9, Observation::Quiet)]);
    }

    #[test]
    fn nothing_is_reported_before_the_channel_has_warmed_up() {
        let mut monitor = Monitor::new(2.0, 11, 3);
        assert_eq!(observe(&mut monitor, &[9.0, 9.0]), []);
        assert!(!monitor.is_watched());
    }

    #[test]
    fn an_undefined_divergence_neither_starts_nor_ends_a_change() {
        let mut monitor = Monitor::new(2.0, 5, 2);
        observe(&mut monitor, &[9.0]);
        for k in 1..10 {
            assert_eq!(
                monitor.observe(Step(k), 0.0, DivergenceOutcome::Undefined),
                Observation::Nothing
            );
        }
        assert!(monitor.is_active());
    }
}
