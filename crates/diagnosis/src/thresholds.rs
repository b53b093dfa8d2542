//! The thresholds of a module, with where they come from.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use truss::Structure;
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
    /// What they were made for; unknown of older files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub made_for: Option<MadeFor>,
    /// What was measured of the effects of faults; without it no ratio is that of a root cause unless the module's
    /// configuration says so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub effects: Option<MeasuredEffects>,
    /// The detection that they were made for.
    pub detection: DetectionSection,
    /// The threshold of each channel, by component: `"sensor/g5" = 0.4`.
    pub thresholds: BTreeMap<Component, f64>,
}

/// What thresholds were made for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MadeFor {
    /// Fingerprint of the module's part of the structure.
    pub structure: String,
    /// Length of a step \[s\].
    pub step_s: f64,
    /// The simulated loads, in words; of recorded data, see the recordings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loads: Option<String>,
}

impl MadeFor {
    /// A module's part of the structure, sampled every `step_s` seconds.
    #[must_use]
    pub fn new(structure: &Structure, step_s: f64) -> Self {
        let structure = fingerprint(|take| take(structure.to_toml().as_bytes()));
        Self { structure, step_s, loads: None }
    }

    fn problems(&self, used_for: &Self) -> impl Iterator<Item = ThresholdProblem> {
        let structure =
            (self.structure != used_for.structure).then_some(ThresholdProblem::OtherStructure);
        let is_other = (self.step_s / used_for.step_s - 1.0).abs() > 1e-9;
        let step = is_other.then_some(ThresholdProblem::OtherStep {
            made_for: self.step_s,
            used_for: used_for.step_s,
        });
        structure.into_iter().chain(step)
    }
}

/// The effects of simulated faults on healthy components, and the settings of isolation that follow, unless the module's
/// configuration has its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasuredEffects {
    /// Runs with a fault.
    pub runs: u64,
    /// The largest ratio of an effect to its threshold within the tie.
    pub largest_ratio: f64,
    /// Factor on it.
    pub margin: f64,
    /// `isolation.root_ratio`.
    pub root_ratio: f64,
    /// The longest time between a fault's own change, as it enters the interval or leaves it, and an effect \[ms\].
    pub latest_ms: f64,
    /// `isolation.effect_ms`, at most as long as the interval.
    pub effect_ms: f64,
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
        "`{setting}` was {made_with} when these were made, but the module is configured with {used_with}; recalibrate or configure {made_with}"
    )]
    OtherDetection {
        /// The setting.
        setting: &'static str,
        /// Its value when they were made.
        made_with: String,
        /// Its value now.
        used_with: String,
    },
    /// Made for another part of the structure, or another structure.
    #[error("made for another structure than the module's; recalibrate")]
    OtherStructure,
    /// Made for another sampling.
    #[error(
        "made for steps of {made_for} s, but the module has steps of {used_for} s; recalibrate"
    )]
    OtherStep {
        /// Its step when they were made \[s\].
        made_for: f64,
        /// Its step now \[s\].
        used_for: f64,
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
            ThresholdProblem::OtherStructure => &["made_for", "structure"],
            ThresholdProblem::OtherStep { .. } => &["made_for", "step_s"],
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
    /// The thresholds in the order of `components`. What they were made for is compared if it is known on both sides.
    ///
    /// # Errors
    /// Everything that does not fit.
    pub fn fit(
        &self,
        module: &ModuleName,
        components: &[Component],
        detection: &DetectionSection,
        used_for: Option<&MadeFor>,
    ) -> Result<Vec<f64>, Vec<ThresholdProblem>> {
        let mut problems = Vec::new();
        if self.module != *module {
            let (found, expected) = (self.module.clone(), module.clone());
            problems.push(ThresholdProblem::OtherModule { found, expected });
        }
        problems.extend(self.provenance.problems());
        let made_for = self.made_for.as_ref().zip(used_for);
        problems.extend(
            made_for.into_iter().flat_map(|(made_for, used_for)| made_for.problems(used_for)),
        );
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
        fingerprint(|take| {
            for (component, value) in &self.thresholds {
                take(component.to_string().as_bytes());
                take(&value.to_bits().to_le_bytes());
            }
        })
    }
}

/// FNV-1a hash of the bytes that `give` passes to its callback.
fn fingerprint(give: impl FnOnce(&mut dyn FnMut(&[u8]))) -> String {
    let mut hash: u64 = 0xcbf2_9ce4_8422_2325;
    give(&mut |bytes| {
        for byte in bytes {
            hash = (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    });
    format!("{hash:016x}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::divergence::Interval;

    fn made_for(step_s: f64) -> MadeFor {
        let loads = Some("wind of 8 to 14 m/s".into());
        MadeFor { structure: "0123456789abcdef".into(), step_s, loads }
    }

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
            made_for: Some(made_for(1e-3)),
            effects: None,
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
        let found =
            thresholds.fit(&module, &components(), detection, Some(&made_for(1e-3))).unwrap_err();
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
        let fitted = thresholds().fit(
            &module,
            &components,
            &DetectionSection::default(),
            Some(&made_for(1e-3)),
        );
        assert_eq!(fitted, Ok(vec![1.0 / 3.0, 0.5]));
    }

    #[test]
    fn thresholds_made_for_another_detection_are_refused_and_the_setting_is_named() {
        let detection = DetectionSection { lag: 20, ..Default::default() };
        let found = problems(&thresholds(), &detection);
        assert_eq!(found.len(), 1);
        let sliding = Interval::Sliding { vectors: 400 };
        let detection = DetectionSection { interval: sliding, ..Default::default() };
        let found_of_interval = problems(&thresholds(), &detection);
        let said = "`interval` was the latest 2000 residual vectors when these were made, but the module is configured with the \
                    latest 400 residual vectors; recalibrate or configure the latest 2000 residual vectors";
        assert_eq!(found_of_interval, [said]);
        assert!(found[0].contains("`lag` was 5") && found[0].contains("with 20"), "{}", found[0]);
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
    fn thresholds_made_for_another_structure_or_step_are_refused() {
        let other = MadeFor { structure: "0".into(), step_s: 5e-3, loads: None };
        let of = |thresholds: Thresholds| {
            let module = "module1".parse().unwrap();
            let fitted = thresholds.fit(&module, &components(), &Default::default(), Some(&other));
            fitted.map_err(|problems| problems.iter().map(ToString::to_string).collect::<Vec<_>>())
        };
        let found = of(thresholds()).unwrap_err();
        assert!(found[0].contains("another structure"), "{found:?}");
        assert!(
            found[1].contains("steps of 0.001 s, but the module has steps of 0.005 s"),
            "{found:?}"
        );
        // what older files were made for is not known
        assert!(of(Thresholds { made_for: None, ..thresholds() }).is_ok());
    }

    #[test]
    fn another_threshold_has_another_fingerprint() {
        let mut other = thresholds();
        other.thresholds.insert("sensor/g1".parse().unwrap(), 0.3);
        assert_ne!(other.fingerprint(), thresholds().fingerprint());
        assert_eq!(thresholds().fingerprint().len(), 16);
    }
}
