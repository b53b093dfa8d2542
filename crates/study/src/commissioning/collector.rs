//! Converts a module's samples from any source to the means of its windows.

use diagnosis::divergence::{DivergenceSettings, Interval};
use diagnosis::state::{WindowLength, WindowMeans};
use diagnosis::{Action, Diagnoser, Measurements, ModuleSetup};
use vocabulary::Step;

use crate::error::StudyError;
use crate::group::diagnoser;
use crate::rig::RigError;

/// Time after which the models' initial transients have decayed \[s\].
pub const SETTLING_S: f64 = 2.5;
/// After a longer gap the models restart \[s\].
const LONGEST_GAP_S: f64 = 0.1;
/// A threshold that no divergence reaches, so that nothing is judged and no peer is queried.
const OUT_OF_REACH: f64 = f64::MAX;
/// The cheapest divergence: means of windows do not depend on it.
const ANY_DIVERGENCE: DivergenceSettings =
    DivergenceSettings { window: 1, lag: 1, interval: Interval::Growing };

/// Processes the samples of one module, and keeps the means of its windows.
#[derive(Debug)]
pub struct WindowCollector {
    diagnoser: Diagnoser,
    actions: Vec<Action>,
    step_s: f64,
    last_step: Option<Step>,
    /// The first step at which the models have settled.
    settled: Step,
    windows: Vec<WindowMeans>,
}

impl WindowCollector {
    /// Starts without samples. Thresholds, divergence and reference in `setup` are ignored.
    ///
    /// # Errors
    /// The setup is invalid.
    pub fn new(setup: &ModuleSetup) -> Result<Self, StudyError> {
        let mut setup = ModuleSetup { reference: None, ..setup.clone() };
        setup.thresholds.fill(OUT_OF_REACH);
        setup.detection.divergence = ANY_DIVERGENCE;
        Ok(Self {
            step_s: setup.step_s,
            diagnoser: diagnoser(setup).map_err(RigError::from)?,
            actions: Vec::new(),
            last_step: None,
            settled: Step(0),
            windows: Vec::new(),
        })
    }

    /// Takes the next sample. Its step lies after that of the sample before, or the sample is not used.
    pub fn take(&mut self, sample: &Measurements) {
        let gap = self.last_step.map(|last| sample.step.since(last));
        if gap.is_none_or(|gap| gap > self.steps(LONGEST_GAP_S)) {
            self.settled = sample.step.plus(self.steps(SETTLING_S));
        }
        self.last_step = Some(sample.step);
        self.diagnoser.take_sample(sample, &mut self.actions);
        self.actions.clear();
        let windows = WindowLength::ALL.into_iter().filter_map(|l| self.diagnoser.window(l));
        let settled = |window: &&WindowMeans| window.until >= self.settled;
        self.windows.extend(windows.filter(settled).cloned());
    }

    fn steps(&self, seconds: f64) -> u64 {
        (seconds / self.step_s).round() as u64
    }

    /// The windows of both lengths that ended after the models had settled.
    #[must_use]
    pub fn finish(self) -> Vec<WindowMeans> {
        self.windows
    }
}
