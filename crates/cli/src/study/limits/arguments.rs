//! What `trusswatch study limits` takes.

use std::num::NonZeroU64;
use std::path::PathBuf;

use study::conditions::{CaseKind, ConditionCampaign};

use crate::failure::Failure;
use crate::shipped::MODULES;
use crate::study::arguments::JobsArguments;
use crate::study::drawn_plants::DrawnPlants;
use crate::study::preset;
use crate::study::weather::Weather;

/// Measure the smallest fault that each detector finds within a time, by weather
///
/// Draws so many plants in each weather, each commissioned in the weather like by `trusswatch study conditions`, and gives them biases
/// and leaks of growing size: to the change detector ones that jump in, to the comparison with a reference ones that
/// are there from the first sample on. Gages, cylinders and plants take turns. Everything follows from the seed.
#[derive(Debug, clap::Args)]
pub(in crate::study) struct Arguments {
    #[command(flatten)]
    pub(super) drawn: DrawnPlants,
    /// Runs for each size, detector and weather, shared among the plants
    #[arg(long, default_value = "30", value_name = "N")]
    pub(super) runs: NonZeroU64,
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
        let shipped = preset::with_shipped(weather.plant(), MODULES, preset::read)?;
        self.drawn.campaign(shipped, 0, CaseKind::default())
    }
}
