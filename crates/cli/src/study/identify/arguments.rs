//! What `trusswatch study identify` takes.

use std::num::NonZeroU64;
use std::path::PathBuf;

use names::fault::FaultKind;
use study::conditions::{CaseKind, ConditionCampaign};
use study::identification::{IdentificationCases, IdentificationSituation};

use crate::failure::Failure;
use crate::shipped::MODULES;
use crate::study::arguments::{JobsArguments, named};
use crate::study::drawn_plants::DrawnPlants;
use crate::study::preset;
use crate::study::weather::Weather;

/// Identify faults of every kind: is their kind right, and is their size within what is said?
///
/// Draws so many plants, each commissioned in the weather like by `trusswatch study conditions`, and gives each of them
/// so many faults, kinds and situations taking turns: alone, right after another one's effects, during a hard-over, as
/// the second one. Sizes are drawn from half the smallest that is found on. A case follows from the seed and its own
/// number alone; case N is one of plant N/cases.
#[derive(Debug, clap::Args)]
pub(in crate::study) struct Arguments {
    #[command(flatten)]
    pub(super) drawn: DrawnPlants,
    /// Faults of each plant
    #[arg(long, default_value = "130", value_name = "N")]
    pub(super) cases: NonZeroU64,
    /// Weather of the shipped plant
    #[arg(long, value_enum, default_value = "alike", value_name = "NAME")]
    pub(super) weather: Weather,
    /// Only faults of this kind
    #[arg(long, value_name = "NAME", value_parser = named(FaultKind::ALL, FaultKind::as_str))]
    kind: Option<FaultKind>,
    /// Only faults in this situation
    #[arg(long, value_name = "NAME", value_parser = named(IdentificationSituation::ALL, IdentificationSituation::as_str))]
    situation: Option<IdentificationSituation>,
    /// Size of every fault that has one, in limits of its kind: the smallest that is found within about two seconds
    #[arg(long, value_name = "X")]
    in_limits: Option<f64>,
    #[command(flatten)]
    pub(super) jobs: JobsArguments,
    /// Write the share of undecided faults against their size into this file, as a figure
    #[arg(long, value_name = "FILE.svg")]
    pub(super) svg: Option<PathBuf>,
    /// Print one JSON object instead of tables
    #[arg(long)]
    pub(super) json: bool,
}

impl Arguments {
    /// Which faults.
    pub(super) fn asked(&self) -> Result<IdentificationCases, Failure> {
        if let Some(size) = self.in_limits.filter(|size| !(0.01..=1000.0).contains(size)) {
            return Err(Failure::usage(format!(
                "`--in-limits` is {size}; use a number from 0.01 to 1000"
            )));
        }
        let Self { kind, situation, in_limits, .. } = *self;
        Ok(IdentificationCases { kind, situation, in_limits })
    }

    /// The campaign whose plants they are given to.
    pub(super) fn campaign(&self) -> Result<ConditionCampaign, Failure> {
        let shipped = preset::with_shipped(self.weather.plant(), MODULES, preset::read)?;
        self.drawn.campaign(shipped, self.cases.get(), CaseKind::default())
    }
}
