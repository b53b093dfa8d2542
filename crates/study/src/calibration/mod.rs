//! Thresholds from fault-free data: the largest divergence of a disturbed but healthy structure, times a margin
//! (section 4.3 of the paper), or the tail of its peaks.

mod collector;
mod effects;
mod nominal_runs;
mod recording;

use vocabulary::{Component, ComponentPath, ModuleName};

use crate::tail::{LargestPeaks, TailError, TailThreshold, tail_threshold};

pub use effects::{EffectRuns, Effects};
pub use nominal_runs::{NominalRuns, plant};
pub use recording::{ResidualRecording, StepOrder};

/// The divergences of fault-free data.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Calibration {
    /// The modules.
    pub modules: Vec<ModulePeaks>,
}

/// The divergences of one module.
#[derive(Debug, Clone, PartialEq)]
pub struct ModulePeaks {
    /// The module.
    pub module: ModuleName,
    /// Steps at which every channel was watched and had a divergence, summed over the runs.
    pub watched_steps: u64,
    /// Actuators, then gages.
    pub channels: Vec<ChannelPeaks>,
}

/// The divergences of one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelPeaks {
    /// The channel.
    pub component: Component,
    /// The largest peaks of its divergence.
    pub peaks: LargestPeaks,
}

impl Calibration {
    /// Merges the divergences of another run of the same modules. The order does not matter.
    pub fn merge(&mut self, other: &Calibration) {
        if self.modules.is_empty() {
            self.modules.clone_from(&other.modules);
            return;
        }
        for (mine, theirs) in self.modules.iter_mut().zip(&other.modules) {
            mine.watched_steps += theirs.watched_steps;
            for (mine, theirs) in mine.channels.iter_mut().zip(&theirs.channels) {
                mine.peaks.merge(&theirs.peaks);
            }
        }
    }

    /// The smallest number of steps, over all modules, at which every channel of the module was watched.
    #[must_use]
    pub fn watched_steps(&self) -> u64 {
        self.modules.iter().map(|module| module.watched_steps).min().unwrap_or(0)
    }

    /// The thresholds that all channels together are expected to reach `per_hour` times an hour, each equally often: a
    /// list for each module. `step_s` is the length of a step \[s\].
    ///
    /// Channels that change together are counted separately, so the structure as a whole has fewer false alarms.
    ///
    /// # Errors
    /// The rate is out of range, or the peaks of some channels do not permit a threshold: of several channels, the one
    /// that needs most data is reported.
    pub fn tail_thresholds(
        &self,
        step_s: f64,
        per_hour: f64,
    ) -> Result<Vec<Vec<TailThreshold>>, TailError> {
        let channels: usize = self.modules.iter().map(|module| module.channels.len()).sum();
        let of_each = per_hour / channels as f64;
        let (mut thresholds, mut errors) = (Vec::new(), Vec::new());
        for module in &self.modules {
            let hours = module.watched_steps as f64 * step_s / 3600.0;
            let (found, failed): (Vec<_>, Vec<_>) = (module.channels.iter())
                .map(|channel| {
                    let path = ComponentPath {
                        module: module.module.clone(),
                        component: channel.component.clone(),
                    };
                    tail_threshold(&path, &channel.peaks, hours, of_each)
                })
                .partition(Result::is_ok);
            thresholds.push(found.into_iter().flatten().collect());
            errors.extend(failed.into_iter().filter_map(Result::err));
        }
        let worst = errors.into_iter().max_by(|a, b| a.needed_hours().total_cmp(&b.needed_hours()));
        worst.map_or(Ok(thresholds), Err)
    }
}
