//! The thresholds of a module, with where they come from.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use vocabulary::{Component, ModuleName};

use crate::sections::DetectionSection;

/// A thresholds file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Thresholds {
    /// The module.
    pub module: ModuleName,
    /// How they were made.
    pub provenance: Provenance,
    /// The detection that they were made for.
    pub detection: DetectionSection,
    /// The threshold of each channel, by component: `"sensor/g5" = 0.4`.
    pub thresholds: BTreeMap<Component, f64>,
}

/// How thresholds were made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// By what method.
    pub method: String,
    /// Seeds of the simulated runs without a fault, e.g. `1000..1040`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seeds: Option<String>,
    /// Files of recorded residuals without a fault.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub recordings: Vec<String>,
    /// How many runs or recordings.
    pub runs: u64,
    /// Hours of data that were judged.
    pub hours: f64,
    /// Factor on what was found.
    pub margin: f64,
    /// By how much each run's plant differed from the nominal model, e.g. 0.1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mismatch: Option<f64>,
    /// False alarms per hour of the whole structure that they were made for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub false_alarms_per_hour: Option<f64>,
    /// Anything else.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// A mismatch between thresholds and the module they are used for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ThresholdProblem {
    /// Another module's.
    #[error("these are the thresholds of `{found}`; give those of `{expected}`")]
    OtherModule {
        /// Whose they are.
        found: ModuleName,
        /// Whose they should be.
        expected: ModuleName,
    },
    /// Made for another detection.
    #[error(
        "made with `{setting}` {made_with}, but the module is configured with {used_with}; recalibrate or configure {made_with}"
    )]
    OtherDetection {
        /// The setting.
        setting: &'static str,
        /// Its value when they were made.
        made_with: String,
        /// Its value now.
        used_with: String,
    },
    /// A channel has none.
    #[error("no threshold for `{0}`; recalibrate")]
    Missing(Component),
    /// A threshold of no channel.
    #[error("`{0}` is not a component of the module; remove its threshold")]
    Unknown(Component),
    /// A figure of the provenance out of range.
    #[error("`{name}` is {value}; use {expected}")]
    Provenance {
        /// The figure.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// A threshold out of range.
    #[error("the threshold of `{component}` is {value}; use a finite number above 0")]
    Value {
        /// The channel.
        component: Component,
        /// The threshold.
        value: f64,
    },
}

impl ThresholdProblem {
    /// Where in the file the problem lies.
    #[must_use]
    pub fn place(&self) -> Vec<String> {
        let path: &[&str] = match self {
            ThresholdProblem::OtherModule { .. } => &["module"],
            ThresholdProblem::OtherDetection { setting, .. } => &["detection", setting],
            ThresholdProblem::Provenance { name, .. } => &["provenance", name],
            ThresholdProblem::Missing(_) => &["thresholds"],
            ThresholdProblem::Unknown(component) | ThresholdProblem::Value { component, .. } => {
                return vec!["thresholds".to_owned(), component.to_string()];
            }
        };
        path.iter().map(ToString::to_string).collect()
    }
}

impl Provenance {
    fn problems(&self) -> impl Iterator<Item = ThresholdProblem> {
        let not_negative = (0.0..f64::INFINITY, "0 or a finite number above 0");
        let positive = (f64::MIN_POSITIVE..f64::INFINITY, "a finite number above 0");
        let figures = [
            ("runs", Some(self.runs as f64), (0.0..1e9, "less than 1e9")),
            ("hours", Some(self.hours), not_negative.clone()),
            ("margin", Some(self.margin), positive),
            ("mismatch", self.mismatch, (0.0..1.0, "0 or more, and less than 1")),
            ("false_alarms_per_hour", self.false_alarms_per_hour, not_negative),
        ];
        figures.into_iter().filter_map(|(name, value, (range, expected))| {
            let value = value.filter(|value| !range.contains(value))?;
            Some(ThresholdProblem::Provenance { name, value, expected })
        })
    }
}

impl Thresholds {
    /// The thresholds in the order of `components`.
    ///
    /// # Errors
    /// Everything that does not fit.
    pub fn fit(
        &self,
        module: &ModuleName,
        components: &[Component],
        detection: &DetectionSection,
    ) -> Result<Vec<f64>, Vec<ThresholdProblem>> {
        let mut problems = Vec::new();
        if self.module != *module {
            let (found, expected) = (self.module.clone(), module.clone());
            problems.push(ThresholdProblem::OtherModule { found, expected });
        }
        problems.extend(self.provenance.problems());
        for (setting, made_with, used_with) in self.detection.differences(detection) {
            problems.push(ThresholdProblem::OtherDetection { setting, made_with, used_with });
        }
        for (component, &value) in &self.thresholds {
            if !components.contains(component) {
                problems.push(ThresholdProblem::Unknown(component.clone()));
            } else if !(value.is_finite() && value > 0.0) {
                problems.push(ThresholdProblem::Value { component: component.clone(), value });
            }
        }
        let mut ordered = Vec::with_capacity(components.len());
        for component in components {
            match self.thresholds.get(component) {
                Some(value) => ordered.push(*value),
                None => problems.push(ThresholdProblem::Missing(component.clone())),
            }
        }
        if problems.is_empty() { Ok(ordered) } else { Err(problems) }
    }

    /// Distinguishes one set of thresholds from another in a status message (FNV-1a over components and bits).
    #[must_use]
    pub fn fingerprint(&self) -> String {
        let mut hash: u64 = 0xcbf2_9ce4_8422_2325;
        let mut take = |bytes: &[u8]| {
            for byte in bytes {
                hash = (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
            }
        };
        for (component, value) in &self.thresholds {
            take(component.to_string().as_bytes());
            take(&value.to_bits().to_le_bytes());
        }
        format!("{hash:016x}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::divergence::Interval;

    fn thresholds() -> Thresholds {
        Thresholds {
            module: "module1".parse().unwrap(),
            provenance: Provenance {
                method: "maximum".into(),
                seeds: Some("1..40".into()),
                recordings: Vec::new(),
                runs: 40,
                hours: 0.5,
                margin: 2.5,
                mismatch: Some(0.1),
                false_alarms_per_hour: None,
                note: None,
            },
            detection: DetectionSection::default(),
            thresholds: [("actuator/a1", 0.5), ("sensor/g1", 1.0 / 3.0)]
                .map(|(name, value)| (name.parse().unwrap(), value))
                .into(),
        }
    }

    fn components() -> Vec<Component> {
        vec!["actuator/a1".parse().unwrap(), "sensor/g1".parse().unwrap()]
    }

    fn problems(thresholds: &Thresholds, detection: &DetectionSection) -> Vec<String> {
        let module = "module1".parse().unwrap();
        let found = thresholds.fit(&module, &components(), detection).unwrap_err();
        found.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn a_file_is_written_and_read_back() {
        let text = toml::to_string(&thresholds()).unwrap();
        assert_eq!(toml::from_str::<Thresholds>(&text).unwrap(), thresholds());
        let growing = DetectionSection { interval: Interval::Growing, ..Default::default() };
        let growing = Thresholds { detection: growing, ..thresholds() };
        let text = toml::to_string(&growing).unwrap();
        assert_eq!(toml::from_str::<Thresholds>(&text).unwrap(), growing);
    }

    #[test]
    fn thresholds_that_fit_come_in_the_order_of_the_channels() {
        let module = "module1".parse().unwrap();
        let mut components = components();
        components.reverse();
        let fitted = thresholds().fit(&module, &components, &DetectionSection::default());
        assert_eq!(fitted, Ok(vec![1.0 / 3.0, 0.5]));
    }

    #[test]
    fn thresholds_made_for_another_detection_are_refused_and_the_setting_is_named() {
        let detection = DetectionSection { lag: 20, ..Default::default() };
        let found = problems(&thresholds(), &detection);
        assert_eq!(found.len(), 1);
        assert!(found[0].contains("`lag` 5") && found[0].contains("with 20"), "{}", found[0]);
        let other = DetectionSection {
            window: 1,
            interval: Interval::Growing,
            actuator_residual: crate::residual::ActuatorResidual::Demand,
            warm_up_vectors: 5,
            ..Default::default()
        };
        assert_eq!(problems(&thresholds(), &other).len(), 4);
    }

    #[test]
    fn missing_unknown_and_impossible_thresholds_are_named_all_at_once() {
        let mut bad = thresholds();
        bad.module = "module2".parse().unwrap();
        bad.thresholds.remove(&"actuator/a1".parse().unwrap());
        bad.thresholds.insert("actuator/a9".parse().unwrap(), 1.0);
        bad.thresholds.insert("sensor/g1".parse().unwrap(), f64::NAN);
        let found = problems(&bad, &DetectionSection::default()).join("\n");
        for named in ["`module2`", "`actuator/a1`", "`actuator/a9`", "`sensor/g1` is NaN"] {
            assert!(found.contains(named), "{named} in {found}");
        }
        assert_eq!(found.lines().count(), 4);
    }

    #[test]
    fn another_threshold_has_another_fingerprint() {
        let mut other = thresholds();
        other.thresholds.insert("sensor/g1".parse().unwrap(), 0.3);
        assert_ne!(other.fingerprint(), thresholds().fingerprint());
        assert_eq!(thresholds().fingerprint().len(), 16);
    }
}
