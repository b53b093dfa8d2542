//! The settings of a diagnoser and the description of its module.

use std::ops::RangeInclusive;
use std::sync::Arc;

use serde::{Deserialize, Deserializer, Serialize};
use truss::Structure;
use vocabulary::{Component, GageName, ModuleName, StructureName};

use crate::change::MAX_TIE;
use crate::divergence::{DivergenceSettings, Interval, MAX_INTERVAL, SettingsError};
use crate::residual::{ActuatorResidual, HydraulicsError, NominalHydraulics};
use crate::state::learned::{LearnedChannel, LearnedModule};
use crate::state::{Reference, ReferenceProblem};

/// Which components may be the root of other components' changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Rule {
    /// The first change in the structure, of whatever component, names the fault and explains the
    /// later ones.
    #[default]
    FirstChange,
    /// Algorithm 4.3 of the paper: only actuator faults explain, and permanently.
    Paper,
}

/// How a change becomes a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IsolationSettings {
    /// Which components may be roots.
    pub rule: Rule,
    /// Steps from a change to its judgement; at least twice the tie under the rule of the first
    /// change.
    pub hold_steps: u64,
    /// Changes at most this many steps apart are simultaneous: the larger D/γ decides.
    pub tie_steps: u64,
    /// D/γ from which on a change, if it gets there within the tie, is a root cause of its own; infinite for never.
    #[serde(deserialize_with = "infinite_if_none")]
    pub root_ratio: f64,
    /// Steps that the effects of a root cause take to show: so long after it has stopped changing it explains
    /// other components' changes. At least `quiet_steps`.
    pub effect_steps: u64,
    /// Steps below the threshold after which a channel counts as quiet again.
    pub quiet_steps: u64,
}

/// Duration of ties, effects and quiet \[s\].
const TIE_S: f64 = 3e-3;
const EFFECT_S: f64 = 0.25;
const QUIET_S: f64 = 0.04;

impl IsolationSettings {
    /// Times that suit the tower, in steps of `step_s` seconds, at least as many as the detection needs. No ratio is that of
    /// a root cause until it is known how large effects become (`trusswatch calibrate`).
    #[must_use]
    pub fn at(step_s: f64, detection: &DetectionSettings) -> Self {
        // Tolerates rounding errors, so that whole numbers are not rounded up.
        let steps = |time_s: f64| (time_s / step_s * (1.0 - 1e-9)).ceil() as u64;
        let tie_steps = steps(TIE_S);
        let quiet_steps = steps(QUIET_S);
        let interval = detection.divergence.interval.vectors().map_or(u64::MAX, |m| m as u64);
        Self {
            rule: Rule::FirstChange,
            hold_steps: 2 * tie_steps,
            tie_steps,
            root_ratio: f64::INFINITY,
            effect_steps: steps(EFFECT_S).max(quiet_steps).min(interval),
            quiet_steps,
        }
    }
}

/// What of a module's detection the thresholds depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetectionSettings {
    /// Window, lag and interval.
    #[serde(flatten)]
    pub divergence: DivergenceSettings,
    /// Which residual an actuator is watched by.
    pub actuator_residual: ActuatorResidual,
    /// Vectors that a channel must have taken before it is judged. In sliding mode more than the
    /// interval holds: what the models did while they settled has then left the Gaussian again.
    pub warm_up_vectors: u64,
}

/// Duration of the interval, and the fewest vectors in it: with fewer, a Gaussian of [`WINDOW`] values is poorly known.
const INTERVAL_S: f64 = 2.0;
const FEWEST_VECTORS: f64 = 200.0;
/// Samples in a lagged vector and steps between the Gaussians: what tells a jump from noise is a number of samples.
const WINDOW: usize = 12;
const LAG: usize = 5;

impl DetectionSettings {
    /// What suits any structure, sampled every `step_s` seconds: an interval of two seconds or 200 vectors, and a quarter
    /// more to warm up.
    #[must_use]
    pub fn at(step_s: f64) -> Self {
        let vectors = (INTERVAL_S / step_s).round().clamp(FEWEST_VECTORS, MAX_INTERVAL as f64);
        let interval = Interval::Sliding { vectors: vectors as usize };
        Self {
            divergence: DivergenceSettings { window: WINDOW, lag: LAG, interval },
            actuator_residual: ActuatorResidual::Tracking,
            warm_up_vectors: (1.25 * vectors).round() as u64,
        }
    }
}

/// Range of plausible values of a signal; a value outside counts as missing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SignalSettings {
    /// No gage survives a larger strain \[m/m\]: 0.1.
    pub largest_strain: f64,
    /// No larger pressure is one \[Pa\]; without it, twice that of the supply. A module without actuators needs none.
    pub largest_pressure_pa: Option<f64>,
}

impl Default for SignalSettings {
    fn default() -> Self {
        Self { largest_strain: 0.1, largest_pressure_pa: None }
    }
}

/// How often the signals are sampled.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sampling {
    step_s: f64,
}

impl Sampling {
    /// So many seconds in steps, at least one.
    pub(crate) fn steps(self, seconds: f64) -> u64 {
        ((seconds / self.step_s).round() as u64).max(1)
    }
}

/// More noise is a mistake of the unit: gages of metal yield at some thousandths. No gage has less.
const NOISE_STRAIN: RangeInclusive<f64> = 1e-12..=LARGEST_NOISE_STRAIN;
const LARGEST_NOISE_STRAIN: f64 = 0.01;
/// Every loaded structure has larger strains than the least.
const LARGEST_STRAIN: RangeInclusive<f64> = 1e-5..=1.0;
/// No pressure gage measures more \[Pa\].
const LARGEST_PRESSURE_PA: f64 = 1e10;
/// Steps that a structural model can take \[s\].
const STEP_S: RangeInclusive<f64> = 1e-6..=1.0;

/// JSON writes what is not finite as `null`.
pub(crate) fn infinite_if_none<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::INFINITY))
}

/// The whole configuration of a diagnoser.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModuleSetup {
    /// Name of the module.
    pub module: ModuleName,
    /// The module's own part of the structure; written as the text of its description.
    #[serde(with = "description")]
    pub structure: Structure,
    /// Its actuators' figures; required if it has actuators, unused otherwise.
    pub hydraulics: Option<NominalHydraulics>,
    /// Noise of a gage as strain \[m/m\].
    pub gage_noise_strain: f64,
    /// Length of a step \[s\].
    pub step_s: f64,
    /// What its signals can be.
    pub signals: SignalSettings,
    /// Detection.
    pub detection: DetectionSettings,
    /// Isolation.
    pub isolation: IsolationSettings,
    /// Threshold γ of each channel: actuators, then gages, in the order of the description.
    pub thresholds: Vec<f64>,
    /// The other modules that are asked.
    pub peers: Vec<ModuleName>,
    /// What is known of the module while it was healthy.
    #[serde(with = "shared")]
    pub reference: Option<Arc<Reference>>,
    /// What was learnt of a module without a structural model. Its channels are sensors, and nothing else of the setup
    /// counts but `module` and `step_s`.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "shared")]
    pub learned: Option<Arc<LearnedModule>>,
    /// Names of a module's readings of which nothing has been learnt: they are recorded, and no diagnoser can be made.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub readings: Vec<GageName>,
}

/// A structure is written as the text of its description.
mod description {
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use truss::Structure;

    /// What stands before the name of a structure of which nothing else is known.
    const UNMODELLED: &str = "# unmodelled: ";

    pub(super) fn serialize<S: Serializer>(
        structure: &Structure,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        // One without modules is known by name only.
        let text = match &structure.modules[..] {
            [] => format!("{UNMODELLED}{}", structure.name),
            _ => structure.to_toml(),
        };
        text.serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Structure, D::Error> {
        let text = String::deserialize(deserializer)?;
        if let Some(name) = text.strip_prefix(UNMODELLED) {
            return name.parse().map(Structure::unmodelled).map_err(D::Error::custom);
        }
        Structure::from_toml(&text).map_err(|error| D::Error::custom(error.to_string()))
    }
}

/// What may be there and is shared is written as if it were not shared.
pub(crate) mod shared {
    use std::sync::Arc;

    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<T: Serialize, S: Serializer>(
        shared: &Option<Arc<T>>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        shared.as_deref().serialize(serializer)
    }

    pub(crate) fn deserialize<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<Arc<T>>, D::Error> {
        Ok(Option::<T>::deserialize(deserializer)?.map(Arc::new))
    }
}

/// The same for a value that is never absent.
pub(crate) mod always_shared {
    use std::sync::Arc;

    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<T: Serialize + ?Sized, S: Serializer>(
        shared: &Arc<T>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        (**shared).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, T: ?Sized, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Arc<T>, D::Error>
    where
        Box<T>: Deserialize<'de>,
    {
        Box::<T>::deserialize(deserializer).map(Arc::from)
    }
}

/// Something in a module's setup that cannot be right.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SetupError {
    /// A divergence setting.
    #[error(transparent)]
    Divergence(#[from] SettingsError),
    /// No hydraulic figures, and actuators that need them.
    #[error(
        "module `{module}` has actuators ({actuators}) and its configuration has no table `[hydraulics]`; add it with {}",
        NominalHydraulics::REQUIRED.join(", ")
    )]
    NoHydraulics {
        /// The module.
        module: ModuleName,
        /// How many actuators it has.
        actuators: usize,
    },
    /// A hydraulic figure.
    #[error("hydraulics: {0}")]
    Hydraulics(#[from] HydraulicsError),
    /// The structure has no such module, or other modules too.
    #[error("structure does not consist of module `{0}` alone")]
    Structure(ModuleName),
    /// No model can be made of the structure.
    #[error("structure of module `{module}`: {error}")]
    Model {
        /// The module.
        module: ModuleName,
        /// Why.
        error: String,
    },
    /// The reference.
    #[error("reference: {0}")]
    Reference(#[from] ReferenceProblem),
    /// The learned module.
    #[error("learned module: {0}")]
    Learned(String),
    /// Number of thresholds.
    #[error("{found} thresholds for {expected} channels; one for each actuator and each gage")]
    ThresholdCount {
        /// Thresholds given.
        found: usize,
        /// Channels of the module.
        expected: usize,
    },
    /// A threshold out of range.
    #[error("threshold of {component} is {value}; use a finite number above 0")]
    Threshold {
        /// The channel.
        component: String,
        /// The threshold.
        value: f64,
    },
    /// A figure out of range.
    #[error("`{name}` is {value}; use {expected}")]
    Figure {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: String,
        /// What would be right.
        expected: String,
    },
    /// The module itself, or a module twice, among the peers.
    #[error("peer `{0}` is the module itself or listed twice; list every other module once")]
    Peer(ModuleName),
}

impl SetupError {
    /// Where in a diagnoser's file the problem lies.
    #[must_use]
    pub fn place(&self) -> Vec<&str> {
        match self {
            SetupError::Divergence(SettingsError::Window(_)) => vec!["detection", "window"],
            SetupError::Divergence(SettingsError::Lag(_)) => vec!["detection", "lag"],
            SetupError::Divergence(SettingsError::Interval(_)) => vec!["detection", "interval"],
            SetupError::Divergence(SettingsError::PriorScatter(_)) => vec!["gage_noise_strain"],
            SetupError::Hydraulics(error) => vec!["hydraulics", error.name],
            SetupError::NoHydraulics { .. } => vec!["module"],
            SetupError::Figure { name: name @ ("step_s" | "gage_noise_strain"), .. } => vec![name],
            SetupError::Figure {
                name: name @ ("largest_strain" | "largest_pressure_pa"), ..
            } => vec!["signals", name],
            SetupError::Figure { name: name @ "warm_up_vectors", .. } => vec!["detection", name],
            SetupError::Figure { name, .. } => vec!["isolation", name],
            SetupError::Peer(_) => vec!["peers"],
            SetupError::Reference(_) => vec!["reference"],
            SetupError::Learned(_) => vec!["learned"],
            SetupError::Structure(_) | SetupError::Model { .. } => vec!["structure"],
            SetupError::ThresholdCount { .. } | SetupError::Threshold { .. } => vec!["thresholds"],
        }
    }
}

impl ModuleSetup {
    /// A module without a structural model: of `learned`, `thresholds` or `readings` it has none yet.
    #[must_use]
    pub fn of_readings(structure: StructureName, module: ModuleName, step_s: f64) -> Self {
        Self {
            module,
            structure: Structure::unmodelled(structure),
            hydraulics: None,
            gage_noise_strain: LARGEST_NOISE_STRAIN,
            step_s,
            signals: SignalSettings::default(),
            detection: DetectionSettings {
                divergence: DivergenceSettings {
                    window: 1,
                    lag: 1,
                    interval: Interval::Sliding { vectors: 2 },
                },
                actuator_residual: ActuatorResidual::Tracking,
                warm_up_vectors: 2,
            },
            isolation: IsolationSettings {
                rule: Rule::FirstChange,
                hold_steps: 0,
                tie_steps: 0,
                root_ratio: f64::INFINITY,
                effect_steps: 1,
                quiet_steps: 1,
            },
            thresholds: Vec::new(),
            peers: Vec::new(),
            reference: None,
            learned: None,
            readings: Vec::new(),
        }
    }

    /// Does a sample have readings, each in its own unit, in place of demands, pressures and elongations?
    #[must_use]
    pub fn measures_readings(&self) -> bool {
        self.learned.is_some() || !self.readings.is_empty()
    }

    /// Everything that cannot be right, without making a model.
    #[must_use]
    pub fn problems(&self) -> Vec<SetupError> {
        if !self.readings.is_empty() {
            let problem = "nothing has been learnt of these readings; use `trusswatch learn`";
            return vec![SetupError::Learned(problem.to_owned())];
        }
        if let Some(learned) = &self.learned {
            return self.learned_problems(learned);
        }
        let mut problems = Vec::new();
        problems.extend(self.detection.divergence.check().err().map(SetupError::from));
        problems.extend(self.hydraulics_problems());
        problems.extend(self.figure_problems());
        problems.extend(self.threshold_problems());
        problems.extend(self.peer_problems());
        if let Some(reference) = &self.reference {
            problems.extend(reference.problems(self).into_iter().map(SetupError::from));
        }
        problems
    }

    /// Its components: actuators, then gages, in the order of the description.
    #[must_use]
    pub fn components(&self) -> Vec<Component> {
        if let Some(learned) = &self.learned {
            let gages = learned.channels.iter().filter_map(|channel| channel.name.parse().ok());
            return gages.map(Component::Sensor).collect();
        }
        if !self.readings.is_empty() {
            return self.readings.iter().cloned().map(Component::Sensor).collect();
        }
        self.structure
            .module(&self.module)
            .map_or_else(Vec::new, |module| module.components().collect())
    }

    /// How many actuators the module has.
    pub(crate) fn actuators(&self) -> usize {
        self.structure.module(&self.module).map_or(0, |module| module.actuators.len())
    }

    /// How often its signals are sampled.
    pub(crate) fn sampling(&self) -> Sampling {
        Sampling { step_s: self.step_s }
    }

    /// ε of each channel, actuators first, then gages, in the order of the description: the variance
    /// that the noise of the channel's own sensors gives its residual, in N² and m². Empty if the
    /// structure has no such module.
    #[must_use]
    pub fn prior_scatters(&self) -> Vec<f64> {
        let Some(module) = self.structure.module(&self.module) else { return Vec::new() };
        let of_force = self.hydraulics.as_ref().map_or(0.0, NominalHydraulics::force_variance);
        let actuators = module.actuators.iter().map(|_| of_force);
        let gages = module.gages.iter().map(|gage| {
            let deviation = self.gage_noise_strain * self.structure.gage_length_m(gage);
            deviation * deviation
        });
        actuators.chain(gages).collect()
    }

    fn hydraulics_problems(&self) -> Vec<SetupError> {
        match (&self.hydraulics, self.actuators()) {
            (Some(hydraulics), _) => hydraulics.problems().into_iter().map(Into::into).collect(),
            (None, 0) => Vec::new(),
            (None, actuators) => {
                vec![SetupError::NoHydraulics { module: self.module.clone(), actuators }]
            }
        }
    }

    fn learned_problems(&self, learned: &LearnedModule) -> Vec<SetupError> {
        let mut problems: Vec<SetupError> =
            learned.check().err().into_iter().map(SetupError::Learned).collect();
        let name_problem = |channel: &LearnedChannel| {
            let error = channel.name.parse::<GageName>().err()?;
            Some(SetupError::Learned(format!(
                "channel {error}; rename its column, and learn again"
            )))
        };
        problems.extend(learned.channels.iter().filter_map(name_problem));
        let step_s = self.step_s;
        if learned.check_step(step_s).is_err() {
            let expected = format!("seconds above 0, at most the window, {}", learned.window_s);
            problems.push(SetupError::Figure {
                name: "step_s",
                value: step_s.to_string(),
                expected,
            });
        }
        let mut names: Vec<&str> = learned.channels.iter().map(|c| c.name.as_str()).collect();
        names.sort_unstable();
        let twice = names.windows(2).find(|pair| pair[0] == pair[1]);
        problems.extend(twice.map(|pair| {
            SetupError::Learned(format!("there are two channels `{}`; use each name once", pair[0]))
        }));
        problems
    }

    fn figure_problems(&self) -> Vec<SetupError> {
        let mut problems = Vec::new();
        let mut require = |ok: bool, name, value: String, expected: &str| {
            if !ok {
                problems.push(SetupError::Figure { name, value, expected: expected.into() });
            }
        };
        let noise = self.gage_noise_strain;
        let is_noise = NOISE_STRAIN.contains(&noise);
        let expected = "a number from 1e-12 to 0.01: strain in m/m";
        require(is_noise, "gage_noise_strain", format!("{noise:?}"), expected);
        let SignalSettings { largest_strain, largest_pressure_pa } = self.signals;
        let is_strain = LARGEST_STRAIN.contains(&largest_strain);
        let expected = "a number from 1e-5 to 1: strain in m/m";
        require(is_strain, "largest_strain", format!("{largest_strain:?}"), expected);
        if let Some(pressure) = largest_pressure_pa {
            let supply = self.hydraulics.map_or(0.0, |hydraulics| hydraulics.supply_pa);
            let more = match self.hydraulics {
                Some(_) => format!("a pressure above supply_pa, {supply}, and up to 1e10 Pa"),
                None => "a pressure above 0 and up to 1e10 Pa".to_owned(),
            };
            let ok = pressure <= LARGEST_PRESSURE_PA && pressure > supply;
            require(ok, "largest_pressure_pa", pressure.to_string(), &more);
        }
        let is_step = STEP_S.contains(&self.step_s);
        require(is_step, "step_s", format!("{:?}", self.step_s), "a step from 1e-6 to 1 s");
        // What follows is counted in steps.
        if !is_step {
            return problems;
        }
        let tie = self.isolation.tie_steps;
        let step_ms = 1e3 * self.step_s;
        let ms = |steps: u64| (steps as f64 * step_ms).to_string();
        let largest = format!("at most {MAX_TIE} steps of {step_ms} ms");
        require(tie <= MAX_TIE as u64, "tie_ms", ms(tie), &largest);
        let hold = self.isolation.hold_steps;
        let enough = self.isolation.rule == Rule::Paper || hold >= 2 * tie;
        let twice = format!("at least twice tie_ms, {}", ms(2 * tie));
        require(enough, "hold_ms", ms(hold), &twice);
        let ratio = self.isolation.root_ratio;
        require(ratio > 1.0, "root_ratio", ratio.to_string(), "a number above 1, inf for never");
        let quiet = self.isolation.quiet_steps;
        require(quiet >= 1, "quiet_ms", ms(quiet), &format!("at least one step, {step_ms}"));
        let effects = self.isolation.effect_steps;
        let no_less = format!("at least quiet_ms, {}", ms(quiet));
        require(effects >= quiet, "effect_ms", ms(effects), &no_less);
        let interval = self.detection.divergence.interval.vectors().map_or(u64::MAX, |m| m as u64);
        let no_more = format!("at most as long as the interval, {}", ms(interval));
        require(effects <= interval, "effect_ms", ms(effects), &no_more);
        let warm_up = self.detection.warm_up_vectors;
        let interval = self.detection.divergence.interval.vectors().map_or(2, |m| m as u64);
        let full = format!("at least {interval}: a full interval");
        require(warm_up >= interval, "warm_up_vectors", warm_up.to_string(), &full);
        problems
    }

    fn threshold_problems(&self) -> Vec<SetupError> {
        let Some(module) = self.structure.module(&self.module) else {
            return vec![SetupError::Structure(self.module.clone())];
        };
        if self.structure.modules.len() != 1 {
            return vec![SetupError::Structure(self.module.clone())];
        }
        let expected = module.actuators.len() + module.gages.len();
        if self.thresholds.len() != expected {
            let found = self.thresholds.len();
            return vec![SetupError::ThresholdCount { found, expected }];
        }
        let names = (module.actuators.iter().map(|a| a.name.to_string()))
            .chain(module.gages.iter().map(|g| g.name.to_string()));
        names
            .zip(&self.thresholds)
            .filter(|(_, value)| !(value.is_finite() && **value > 0.0))
            .map(|(component, &value)| SetupError::Threshold { component, value })
            .collect()
    }

    fn peer_problems(&self) -> Vec<SetupError> {
        let mut seen = vec![&self.module];
        let mut problems = Vec::new();
        for peer in &self.peers {
            if seen.contains(&peer) {
                problems.push(SetupError::Peer(peer.clone()));
            }
            seen.push(peer);
        }
        problems
    }
}
