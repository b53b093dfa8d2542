//! What `trusswatch study conditions` takes, and what of it cannot be meant.

use std::num::NonZeroU64;
use std::path::PathBuf;

use study::conditions::{CaseKind, ConditionCampaign, Situation};

use crate::failure::Failure;
use crate::shipped::{MODULES, PLANT};
use crate::study::arguments::{JobsArguments, named};
use crate::study::drawn_plants::DrawnPlants;
use crate::study::preset;
use crate::study::weather::Weather;

/// Go through faults that no change shows: from the start, in gaps, creeping, behind other faults
///
/// Draws so many plants, each commissioned in its weather like by `trusswatch commission`: 40 snippets of 12 s, or more
/// if its modules have more than one peer, and two strokes of 100 kN of each cylinder. Then it goes through the cases of
/// each plant. A case follows from the seed and its own number alone; case N is one of plant N/cases. A healthy component
/// that is named is a defect of the diagnosis: the command then fails, and says how to look at that case.
#[derive(Debug, clap::Args)]
pub(in crate::study) struct Arguments {
    #[command(flatten)]
    pub(super) drawn: DrawnPlants,
    /// Cases of each plant; situations take turns
    #[arg(long, default_value = "140", value_name = "N")]
    pub(super) cases: NonZeroU64,
    /// Weather of the shipped plant
    #[arg(long, value_enum, default_value = "alike", value_name = "NAME")]
    pub(super) weather: Weather,
    /// Another plant than the shipped one, with its own weather
    #[arg(long, value_name = "PLANT.toml", conflicts_with = "weather")]
    pub(super) plant: Option<PathBuf>,
    /// Other diagnosers than the shipped ones: their configurations, in the order of the structure
    #[arg(long = "config", value_name = "MODULE.toml", requires = "plant")]
    pub(super) modules: Vec<PathBuf>,
    /// Only cases of this situation
    #[arg(long, value_name = "NAME", value_parser = named(Situation::ALL, Situation::as_str))]
    pub(super) situation: Option<Situation>,
    /// Every fault that may be one is a bias of this size, either way, the gages taking turns; drifts are followed
    /// so far
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    pub(super) bias_microstrain: Option<f64>,
    /// Every fault that may be one is a leak of this coefficient, kinds of leak and cylinders taking turns
    #[arg(long, value_name = "X", conflicts_with = "bias_microstrain", value_parser = leaks)]
    pub(super) leak_area_m2: Option<f64>,
    /// Length of a case in which nothing is wrong [s]; e.g. 600 with `--situation healthy` for many hours
    #[arg(long, value_name = "S", value_parser = lengths)]
    pub(super) healthy_seconds: Option<f64>,
    /// Let every module work without its peers: its reference knows the module alone, and what another module's fault
    /// does to it it takes for a fault of its own, which is no defect here
    #[arg(long)]
    pub(super) alone: bool,
    /// Number of the first case
    #[arg(long, default_value_t = 0, value_name = "K")]
    pub(super) from: u64,
    #[command(flatten)]
    pub(super) jobs: JobsArguments,
    /// Go through the first of them only, and print what happens
    #[arg(long)]
    pub(super) show: bool,
    /// Print one JSON object instead of a table
    #[arg(long, conflicts_with = "show")]
    pub(super) json: bool,
}

/// Reads a leak coefficient.
fn leaks(text: &str) -> Result<f64, String> {
    let leak = text.parse().ok().filter(|leak| (1e-12..=1e-4).contains(leak));
    leak.ok_or_else(|| "use a coefficient from 1e-12 to 1e-4 m²".to_owned())
}

/// Reads a length in seconds.
fn lengths(text: &str) -> Result<f64, String> {
    let length = text.parse().ok().filter(|length| (1.0..=86_400.0).contains(length));
    length.ok_or_else(|| "use a number of seconds from 1 to 86400".to_owned())
}

impl Arguments {
    /// The campaign that they ask for.
    pub(super) fn campaign(&self) -> Result<ConditionCampaign, Failure> {
        self.check()?;
        let (plant, mut setups) = match (&self.plant, &self.modules[..]) {
            (None, _) => preset::with_shipped(self.weather.plant(), MODULES, preset::read)?,
            (Some(plant), []) => {
                preset::with_shipped(PLANT, MODULES, |_, modules| preset::read(plant, modules))?
            }
            (Some(plant), modules) => preset::read(plant, modules)?,
        };
        if self.alone {
            setups.iter_mut().for_each(|setup| setup.peers.clear());
        }
        self.drawn.campaign(
            (plant, setups),
            self.cases.get(),
            CaseKind {
                situation: self.situation,
                bias_strain: self.bias_strain(),
                leak_m2: self.leak_area_m2,
                healthy_s: self.healthy_seconds,
            },
        )
    }

    fn check(&self) -> Result<(), Failure> {
        match self.bias_microstrain.filter(|size| !(0.1..=1e4).contains(size)) {
            Some(size) => Err(Failure::usage(format!(
                "`--bias-microstrain` is {size}; use a number from 0.1 to 10000"
            ))),
            None => Ok(()),
        }
    }

    pub(super) fn bias_strain(&self) -> Option<f64> {
        self.bias_microstrain.map(|size| size * 1e-6)
    }

    /// What the weather is called.
    pub(super) fn weather_name(&self) -> &'static str {
        if self.plant.is_some() { "own" } else { self.weather.as_str() }
    }

    /// The command that shows one of their cases.
    pub(super) fn to_show(&self, number: u64) -> String {
        let mut words = vec!["trusswatch study conditions".to_owned()];
        match &self.plant {
            None => words.push(format!("--weather {}", self.weather.as_str())),
            Some(plant) => words.push(format!("--plant {}", plant.display())),
        }
        words.extend(self.modules.iter().map(|module| format!("--config {}", module.display())));
        let (DrawnPlants { seed, mismatch, .. }, cases) = (&self.drawn, self.cases);
        words.push(format!("--seed {seed} --mismatch {mismatch} --cases {cases}"));
        words.extend(self.situation.map(|situation| format!("--situation {}", situation.as_str())));
        words.extend(self.bias_microstrain.map(|size| format!("--bias-microstrain {size}")));
        words.extend(self.leak_area_m2.map(|leak| format!("--leak-area-m2 {leak}")));
        words.extend(self.healthy_seconds.map(|length| format!("--healthy-seconds {length}")));
        words.extend(self.alone.then(|| "--alone".to_owned()));
        words.push(format!("--from {number} --show"));
        words.join(" ")
    }
}
