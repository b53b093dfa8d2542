//! The settings of detection and isolation in a configuration file; all have defaults.

use std::fmt::Display;

use serde::{Deserialize, Serialize};

use crate::divergence::{DivergenceSettings, Interval};
use crate::residual::ActuatorResidual;
use crate::settings::{DetectionSettings, IsolationSettings, Rule};

/// Detection: the settings that thresholds depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DetectionSection {
    /// Samples in a lagged vector: 12.
    pub window: usize,
    /// Steps between the two compared Gaussians: 5.
    pub lag: usize,
    /// `"growing"` or `{ sliding = { vectors = 2000 } }`; by default those of two seconds, at least 200.
    pub interval: Interval,
    /// `"tracking"`, the default, or `"demand"`.
    pub actuator_residual: ActuatorResidual,
    /// Vectors that a channel must have processed before it is judged: by default 1.25 intervals. This exceeds the
    /// interval, so that the models' initial transients have left it.
    pub warm_up_vectors: u64,
}

impl Default for DetectionSection {
    fn default() -> Self {
        DetectionSettings::at(1e-3).into()
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
    /// Fits what the file leaves open to its sampling step \[s\]. `is_open` tells by the key.
    pub fn fit_to_step(&mut self, step_s: f64, is_open: impl Fn(&str) -> bool) {
        let usual = Self::from(DetectionSettings::at(step_s));
        if is_open("interval") {
            self.interval = usual.interval;
        }
        if is_open("warm_up_vectors") {
            let vectors = self.interval.vectors().map_or(usual.warm_up_vectors, |m| m as u64);
            self.warm_up_vectors = vectors + vectors / 4;
        }
    }

    /// The settings that differ from another section: name, this value, other value.
    #[must_use]
    pub fn differences(&self, other: &Self) -> Vec<(&'static str, String, String)> {
        fn differing<T: PartialEq + Display>(
            name: &'static str,
            this: T,
            other: T,
        ) -> Option<(&'static str, String, String)> {
            (this != other).then(|| (name, this.to_string(), other.to_string()))
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
    /// Time from a change to its judgement \[ms\]: 6.
    pub hold_ms: f64,
    /// Changes at most this far apart are simultaneous \[ms\]: 3.
    pub tie_ms: f64,
    /// A change whose ratio to its threshold reaches this value within the tie is a separate root cause. By default what
    /// `trusswatch calibrate` found, infinite if the thresholds do not say.
    pub root_ratio: Option<f64>,
    /// Duration of effects: a root cause explains changes for this long after it has stopped changing \[ms\]: 250.
    pub effect_ms: f64,
    /// Time below the threshold after which a channel has returned to normal \[ms\]: 40.
    pub quiet_ms: f64,
}

impl Default for IsolationSection {
    fn default() -> Self {
        Self {
            rule: Rule::FirstChange,
            hold_ms: 6.0,
            tie_ms: 3.0,
            root_ratio: None,
            effect_ms: 250.0,
            quiet_ms: 40.0,
        }
    }
}

impl IsolationSection {
    /// Fits times that the file leaves open to its sampling step \[s\]. The written defaults are for 1 kHz, and remain as
    /// they are wherever they fit. `is_open` tells by the key.
    pub fn fit_to_step(
        &mut self,
        step_s: f64,
        detection: &DetectionSection,
        is_open: impl Fn(&str) -> bool,
    ) {
        let step_ms = 1e3 * step_s;
        if is_open("hold_ms") {
            self.hold_ms = self.hold_ms.max(2.0 * step_ms * (self.tie_ms / step_ms).ceil());
        }
        if is_open("effect_ms")
            && let Some(vectors) = detection.interval.vectors()
        {
            let interval_ms = step_ms * vectors as f64;
            self.effect_ms = self.effect_ms.min(interval_ms).max(self.quiet_ms);
        }
    }

    /// The settings in steps of this length \[s\], rounded up.
    #[must_use]
    pub fn in_steps_of(&self, step_s: f64) -> IsolationSettings {
        let step_ms = 1e3 * step_s;
        // Tolerates rounding errors, so that whole numbers are not rounded up.
        let steps = |time_ms: f64| (time_ms / step_ms * (1.0 - 1e-9)).ceil() as u64;
        IsolationSettings {
            rule: self.rule,
            hold_steps: steps(self.hold_ms),
            tie_steps: steps(self.tie_ms),
            root_ratio: self.root_ratio.unwrap_or(f64::INFINITY),
            effect_steps: steps(self.effect_ms),
            quiet_steps: steps(self.quiet_ms),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps(step_s: f64, section: &str) -> [u64; 4] {
        let section: IsolationSection = toml::from_str(section).unwrap();
        let settings = section.in_steps_of(step_s);
        let IsolationSettings { hold_steps, tie_steps, effect_steps, quiet_steps, .. } = settings;
        [hold_steps, tie_steps, effect_steps, quiet_steps]
    }

    #[test]
    fn times_are_steps_at_any_sampling_rate() {
        assert_eq!(steps(1e-3, ""), [6, 3, 250, 40]);
        assert_eq!(steps(0.25e-3, ""), [24, 12, 1000, 160]);
        assert_eq!(steps(5e-3, ""), [2, 1, 50, 8]);
        assert_eq!(steps(1.0 / 1024.0, "hold_ms = 0"), [0, 4, 256, 41]);
    }
}
