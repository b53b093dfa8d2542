//! The settings of detection and isolation as they stand in a file; what is left out is the default.

use std::fmt::Debug;

use diagnosis::divergence::{DivergenceSettings, Interval};
use diagnosis::residual::ActuatorResidual;
use diagnosis::{DetectionSettings, IsolationSettings, Rule};
use serde::{Deserialize, Serialize};

/// Detection: what thresholds depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DetectionSection {
    /// Samples in a lagged vector: 12.
    pub window: usize,
    /// Steps between the two compared Gaussians: 5.
    pub lag: usize,
    /// `"growing"` or `{ sliding = { vectors = 2000 } }`, the default.
    pub interval: Interval,
    /// `"tracking"`, the default, or `"demand"`.
    pub actuator_residual: ActuatorResidual,
    /// Vectors that a channel must have taken before it is judged: 2500. More than the interval
    /// holds, so that what the models did while they settled has left it again.
    pub warm_up_vectors: u64,
}

impl Default for DetectionSection {
    fn default() -> Self {
        Self {
            window: 12,
            lag: 5,
            interval: Interval::Sliding { vectors: 2000 },
            actuator_residual: ActuatorResidual::Tracking,
            warm_up_vectors: 2500,
        }
    }
}

impl From<DetectionSection> for DetectionSettings {
    fn from(section: DetectionSection) -> Self {
        let DetectionSection { window, lag, interval, actuator_residual, warm_up_vectors } =
            section;
        Self {
            divergence: DivergenceSettings { window, lag, interval },
            actuator_residual,
            warm_up_vectors,
        }
    }
}

impl From<DetectionSettings> for DetectionSection {
    fn from(settings: DetectionSettings) -> Self {
        let DetectionSettings { divergence, actuator_residual, warm_up_vectors } = settings;
        let DivergenceSettings { window, lag, interval } = divergence;
        Self { window, lag, interval, actuator_residual, warm_up_vectors }
    }
}

impl DetectionSection {
    /// The settings in which the other differs: name, this value, other value.
    #[must_use]
    pub fn differences(&self, other: &Self) -> Vec<(&'static str, String, String)> {
        fn differing<T: PartialEq + Debug>(
            name: &'static str,
            this: T,
            other: T,
        ) -> Option<(&'static str, String, String)> {
            (this != other).then(|| (name, format!("{this:?}"), format!("{other:?}")))
        }
        [
            differing("window", self.window, other.window),
            differing("lag", self.lag, other.lag),
            differing("interval", self.interval, other.interval),
            differing("actuator_residual", self.actuator_residual, other.actuator_residual),
            differing("warm_up_vectors", self.warm_up_vectors, other.warm_up_vectors),
        ]
        .into_iter()
        .flatten()
        .collect()
    }
}

/// Isolation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct IsolationSection {
    /// `"first_change"`, the default, or `"paper"`.
    pub rule: Rule,
    /// Steps from a change to its judgement: 6.
    pub hold_steps: u64,
    /// Changes at most this many steps apart are simultaneous: 3.
    pub tie_steps: u64,
    /// A change whose ratio to its threshold reaches this within the tie is a root cause of its own: 30.
    pub root_ratio: f64,
    /// Steps that effects take; a root explains for so long after it has stopped changing: 250.
    pub effect_steps: u64,
    /// Steps below the threshold after which a channel is quiet again: 40.
    pub quiet_steps: u64,
}

impl Default for IsolationSection {
    fn default() -> Self {
        Self {
            rule: Rule::FirstChange,
            hold_steps: 6,
            tie_steps: 3,
            root_ratio: 30.0,
            effect_steps: 250,
            quiet_steps: 40,
        }
    }
}

impl From<IsolationSection> for IsolationSettings {
    fn from(section: IsolationSection) -> Self {
        let IsolationSection { rule, hold_steps, tie_steps, root_ratio, effect_steps, quiet_steps } =
            section;
        Self { rule, hold_steps, tie_steps, root_ratio, effect_steps, quiet_steps }
    }
}
