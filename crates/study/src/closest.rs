//! How near a run without a fault came to a false alarm.

use diagnosis::Phase;
use names::{ComponentPath, Step};
use serde::{Deserialize, Serialize};

use crate::rig::Rig;

/// The largest divergence of a run, in units of its channel's threshold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Closest {
    /// The channel's component.
    pub component: ComponentPath,
    /// When.
    pub step: Step,
    /// D/γ; 1 is a change.
    pub ratio: f64,
}

/// The largest so far.
#[derive(Debug, Default)]
pub(crate) struct ClosestSoFar {
    ratio: f64,
    /// Module and channel, and when.
    at: Option<(usize, usize, Step)>,
}

impl ClosestSoFar {
    /// Looks at the latest step of the modules that watch all their channels.
    pub(crate) fn follow(&mut self, rig: &Rig) {
        for (module, diagnoser) in rig.diagnosers().iter().enumerate() {
            if !matches!(diagnoser.phase(), Phase::InService { .. }) {
                continue;
            }
            for (channel, evidence) in diagnoser.evidence().iter().enumerate() {
                let ratio = evidence.ratio();
                if ratio > self.ratio {
                    *self = Self { ratio, at: Some((module, channel, evidence.step)) };
                }
            }
        }
    }

    /// The largest of a run that is over; `None` if no channel was watched.
    pub(crate) fn finish(&self, rig: &Rig) -> Option<Closest> {
        let (module, channel, step) = self.at?;
        let diagnoser = rig.diagnosers().get(module)?;
        let component = ComponentPath {
            module: diagnoser.module().clone(),
            component: diagnoser.components().get(channel)?.clone(),
        };
        Some(Closest { component, step, ratio: self.ratio })
    }
}
