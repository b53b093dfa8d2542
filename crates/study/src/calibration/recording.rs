//! Divergences of recorded residuals.

use diagnosis::divergence::{DivergenceBank, DivergenceOutcome};
use diagnosis::residual::longest_gap_of_structure;
use diagnosis::{ModuleSetup, SetupError};
use vocabulary::Component;

use super::ModulePeaks;
use super::collector::Collector;
use crate::error::StudyError;
use crate::group::GroupError;
use crate::rig::RigError;

/// A step that does not follow its predecessor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("step {step} after step {last}; give each step once, rising")]
pub struct StepOrder {
    /// The step.
    pub step: u64,
    /// The previous step.
    pub last: u64,
}

/// Converts recorded residuals of one module to the peaks of their divergences, as a diagnoser would compute them.
#[derive(Debug, Clone)]
pub struct ResidualRecording {
    components: Vec<Component>,
    bank: DivergenceBank,
    warm_up_vectors: u64,
    /// After more missing steps the channels are learnt anew, as a diagnoser does it.
    longest_bridged: u64,
    /// Skipped steps in a row.
    missing: u64,
    watched: Vec<bool>,
    last_step: Option<u64>,
    collector: Collector,
}

impl ResidualRecording {
    /// Starts without data. The thresholds in `setup` are ignored.
    ///
    /// # Errors
    /// The setup is invalid.
    pub fn new(setup: &ModuleSetup) -> Result<Self, StudyError> {
        let module = &setup.module;
        let fail = |problems| RigError::from(GroupError { module: module.clone(), problems });
        let components: Vec<Component> = (setup.structure.module(&setup.module).into_iter())
            .flat_map(truss::Module::components)
            .collect();
        let thresholds = vec![f64::MAX; components.len()];
        let problems = ModuleSetup { thresholds, ..setup.clone() }.problems();
        if !problems.is_empty() {
            return Err(fail(problems).into());
        }
        let bank = DivergenceBank::new(setup.detection.divergence, &setup.prior_scatters())
            .map_err(|error| fail(vec![SetupError::from(error)]))?;
        Ok(Self {
            bank,
            warm_up_vectors: setup.detection.warm_up_vectors,
            missing: 0,
            longest_bridged: longest_gap_of_structure(setup.step_s),
            watched: vec![false; components.len()],
            last_step: None,
            collector: Collector::new(setup, &components),
            components,
        })
    }

    /// The channels: actuators, then gages, in the order of the description.
    #[must_use]
    pub fn components(&self) -> &[Component] {
        &self.components
    }

    /// Adds the residuals of the next step, \[N\] of actuators and \[m\] of gages, in the order of
    /// [`Self::components`]. Without a number it is the successor of the previous step; windows do not extend over
    /// missing steps, and after a long gap the warm-up restarts. Residuals that are not finite, or whose number differs from that of the channels, count as
    /// missing.
    ///
    /// # Errors
    /// The number is not above that of the previous step.
    pub fn push(&mut self, step: Option<u64>, residuals: &[f64]) -> Result<(), StepOrder> {
        let next = self.last_step.map_or(step.unwrap_or(0), |last| last.saturating_add(1));
        let step = step.unwrap_or(next);
        if let Some(last) = self.last_step.filter(|last| step <= *last) {
            return Err(StepOrder { step, last });
        }
        if step > next {
            self.bank.gap();
            self.collector.skip_many(step - next);
        }
        if std::mem::take(&mut self.missing) + (step - next) > self.longest_bridged {
            self.bank.restart();
            self.watched.fill(false);
        }
        self.last_step = Some(step);
        self.watch(residuals);
        Ok(())
    }

    /// Records that the residuals of the next step are missing.
    pub fn skip(&mut self) {
        self.last_step = Some(self.last_step.map_or(0, |last| last.saturating_add(1)));
        self.missing += 1;
        self.watch(&[]);
    }

    fn watch(&mut self, residuals: &[f64]) {
        let outcomes = self.bank.push(residuals);
        for (watched, outcome) in self.watched.iter_mut().zip(outcomes) {
            match outcome {
                DivergenceOutcome::Undefined => {}
                DivergenceOutcome::Defined { age, .. } => *watched |= *age >= self.warm_up_vectors,
                DivergenceOutcome::Restarted(_) => *watched = false,
            }
        }
        if self.watched.iter().all(|watched| *watched) {
            self.collector.take(outcomes.iter().map(|outcome| outcome.divergence()));
        } else {
            self.collector.skip();
        }
    }

    /// Starts another recording: the warm-up restarts.
    pub fn end_run(&mut self) {
        self.bank.restart();
        self.watched.fill(false);
        self.last_step = None;
        self.collector.end_run();
    }

    /// The peaks of all recordings.
    #[must_use]
    pub fn finish(self) -> ModulePeaks {
        self.collector.finish()
    }
}
