//! What `trusswatch study limits` takes.

use std::num::NonZeroU64;
use std::path::PathBuf;

use study::conditions::{CaseKind, ConditionCampaign};

use crate::failure::Failure;
use crate::shipped::MODULES;
use crate::study::arguments::JobsArguments;
use crate::study::preset;
use crate::study::weather::Weather;

/// Measure the smallest fault that each detector finds within a time, by weather
///
/// Draws so many plants, each commissioned in the weather like by `trusswatch study conditions`, and gives them biases
/// and leaks of growing size: to the change detector ones that jump in, to the comparison with a reference ones that
/// are there from the first sample on. Gages, cylinders and plants take turns. Everything follows from the seed.
#[derive(Debug, clap::Args)]
pub(in crate::study) struct Arguments {
    /// How many plants in each weather
    #[arg(long, default_value = "3", value_name = "N")]
    pub(super) plants: NonZeroU64,
    /// Runs for each size, detector and weather, shared among the plants
    #[arg(long, default_value = "30", value_name = "N")]
    pub(super) runs: NonZeroU64,
    /// Seed of the campaign: plants, weather and faults follow from it
    #[arg(long, default_value_t = 1, value_name = "S")]
    pub(super) seed: u64,
    /// Mismatch of each plant against the nominal model
    #[arg(long, default_value_t = 0.1, value_name = "X", allow_hyphen_values = true)]
    pub(super) mismatch: f64,
    /// Weather of the shipped plant
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        default_value = "none,alike,uneven",
        value_name = "NAME,…"
    )]
    weather: Vec<Weather>,
    #[command(flatten)]
    pub(super) jobs: JobsArguments,
    /// Write the figure into this file
    #[arg(long, value_name = "FILE.svg")]
    pub(super) svg: Option<PathBuf>,
    /// Print one JSON object instead of tables
    #[arg(long)]
    pub(super) json: bool,
}

impl Arguments {
    /// The weather that they ask for, each kind once.
    pub(super) fn weather(&self) -> impl Iterator<Item = Weather> {
        Weather::ALL.into_iter().filter(|weather| self.weather.contains(weather))
    }

    /// The campaign whose plants are commissioned in this weather.
    pub(super) fn campaign(&self, weather: Weather) -> Result<ConditionCampaign, Failure> {
        preset::check_drawn(self.mismatch)?;
        let (plant, setups) = preset::with_shipped(weather.plant(), MODULES, preset::read)?;
        Ok(ConditionCampaign {
            structure: plant.structure,
            parameters: plant.parameters,
            setups,
            mismatch: self.mismatch,
            seed: self.seed,
            // Their cases are not asked for.
            cases_per_plant: 0,
            kind: CaseKind::default(),
        })
    }
}
