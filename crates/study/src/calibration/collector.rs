//! Collects the largest peaks of divergences.

use diagnosis::ModuleSetup;
use vocabulary::Component;

use super::{ChannelPeaks, ModulePeaks};
use crate::tail::{LargestPeaks, PeakFinder};

/// Collects the peaks of one module's divergences.
#[derive(Debug, Clone)]
pub(super) struct Collector {
    reach: u64,
    finders: Vec<PeakFinder>,
    collected: ModulePeaks,
}

impl Collector {
    pub(super) fn new(setup: &ModuleSetup, components: &[Component]) -> Self {
        let channel = |component: &Component| ChannelPeaks {
            component: component.clone(),
            peaks: LargestPeaks::default(),
        };
        let reach = reach(setup);
        Self {
            reach,
            finders: vec![PeakFinder::new(reach); components.len()],
            collected: ModulePeaks {
                module: setup.module.clone(),
                watched_steps: 0,
                channels: components.iter().map(channel).collect(),
            },
        }
    }

    /// Adds a step at which every channel was watched. After a gap some channels have no divergence yet; then the step
    /// does not count.
    pub(super) fn take(&mut self, divergences: impl Iterator<Item = Option<f64>>) {
        let channels = self.finders.iter_mut().zip(&mut self.collected.channels);
        let mut complete = true;
        for ((finder, channel), divergence) in channels.zip(divergences) {
            complete &= divergence.is_some();
            finder.push(divergence).into_iter().for_each(|peak| channel.peaks.push(peak));
        }
        self.collected.watched_steps += u64::from(complete);
    }

    /// Adds a step at which not every channel was watched.
    pub(super) fn skip(&mut self) {
        self.take(std::iter::repeat(None));
    }

    /// Adds missing steps. More of them than the reach end a run.
    pub(super) fn skip_many(&mut self, steps: u64) {
        if steps > self.reach {
            self.end_run();
        } else {
            (0..steps).for_each(|_| self.skip());
        }
    }

    /// Ends a run, so that what follows is independent of it.
    pub(super) fn end_run(&mut self) {
        for (finder, channel) in self.finders.iter_mut().zip(&mut self.collected.channels) {
            finder.finish().into_iter().for_each(|peak| channel.peaks.push(peak));
        }
    }

    pub(super) fn finish(mut self) -> ModulePeaks {
        self.end_run();
        self.collected
    }
}

/// The distance at which peaks are separate \[steps\]: that of separate changes of a channel, and at least the duration
/// of the effect of a single outlier.
fn reach(setup: &ModuleSetup) -> u64 {
    let divergence = setup.detection.divergence;
    setup.isolation.quiet_steps.max((divergence.window + divergence.lag) as u64)
}
