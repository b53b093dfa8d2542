//! What `trusswatch study identify` takes.

use std::num::NonZeroU64;
use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use names::fault::FaultKind;
use study::conditions::{CaseKind, ConditionCampaign};
use study::identification::{IdentificationCases, IdentificationSituation};

use crate::failure::Failure;
use crate::shipped::MODULES;
use crate::study::arguments::JobsArguments;
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
    /// How many plants
    #[arg(long, default_value = "3", value_name = "N")]
    pub(super) plants: NonZeroU64,
    /// Faults of each plant
    #[arg(long, default_value = "130", value_name = "N")]
    pub(super) cases: NonZeroU64,
    /// Seed of the campaign: plants, weather and faults follow from it
    #[arg(long, default_value_t = 1, value_name = "S")]
    pub(super) seed: u64,
    /// Mismatch of each plant against the nominal model
    #[arg(long, default_value_t = 0.1, value_name = "X", allow_hyphen_values = true)]
    pub(super) mismatch: f64,
    /// Weather of the shipped plant
    #[arg(long, value_enum, default_value = "alike", value_name = "NAME")]
    pub(super) weather: Weather,
    /// Only faults of this kind
    #[arg(long, value_name = "NAME", value_parser = kinds())]
    kind: Option<FaultKind>,
    /// Only faults in this situation
    #[arg(long, value_name = "NAME", value_parser = situations())]
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

fn kinds() -> impl TypedValueParser<Value = FaultKind> {
    PossibleValuesParser::new(FaultKind::ALL.map(FaultKind::as_str)).try_map(|name| {
        let named = FaultKind::ALL.into_iter().find(|kind| kind.as_str() == name);
        named.ok_or("no such kind")
    })
}

fn situations() -> impl TypedValueParser<Value = IdentificationSituation> {
    let all = IdentificationSituation::ALL;
    PossibleValuesParser::new(all.map(IdentificationSituation::as_str)).try_map(move |name| {
        let named = all.into_iter().find(|situation| situation.as_str() == name);
        named.ok_or("no such situation")
    })
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
        preset::check_drawn(self.mismatch)?;
        let (plant, setups) = preset::with_shipped(self.weather.plant(), MODULES, preset::read)?;
        Ok(ConditionCampaign {
            structure: plant.structure,
            parameters: plant.parameters,
            setups,
            mismatch: self.mismatch,
            seed: self.seed,
            cases_per_plant: self.cases.get(),
            kind: CaseKind::default(),
        })
    }
}
