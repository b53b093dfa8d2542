//! The plants of a campaign: drawn, commissioned, and gone through case by case.

use std::num::NonZeroU64;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use daemon::config::PlantConfig;
use diagnosis::ModuleSetup;
use study::conditions::{CaseKind, CommissionedPlant, ConditionCampaign};
use study::{StudyError, parallel};

use super::arguments::JobsArguments;
use super::preset;
use super::runs::unusable;
use crate::failure::Failure;
use crate::progress::Progress;

/// How many, and what they follow from.
#[derive(Debug, clap::Args)]
pub(super) struct DrawnPlants {
    /// How many plants
    #[arg(long, default_value = "3", value_name = "N")]
    pub(super) plants: NonZeroU64,
    /// Seed of the campaign: plants, weather and faults follow from it
    #[arg(long, default_value_t = 1, value_name = "S")]
    pub(super) seed: u64,
    /// Mismatch of each plant against the nominal model
    #[arg(long, default_value_t = 0.1, value_name = "X", allow_hyphen_values = true)]
    pub(super) mismatch: f64,
}

impl DrawnPlants {
    /// The campaign with so many cases of each of them.
    pub(super) fn campaign(
        &self,
        (plant, setups): (PlantConfig, Vec<ModuleSetup>),
        cases_per_plant: u64,
        kind: CaseKind,
    ) -> Result<ConditionCampaign, Failure> {
        preset::check_drawn(self.mismatch)?;
        Ok(ConditionCampaign {
            structure: plant.structure,
            parameters: plant.parameters,
            setups,
            mismatch: self.mismatch,
            seed: self.seed,
            cases_per_plant,
            kind,
        })
    }
}

/// Commissions plants one after the other, until stopped.
pub(super) fn commission(
    campaign: &ConditionCampaign,
    numbers: Range<u64>,
    jobs: JobsArguments,
    stop: &AtomicBool,
) -> Result<Vec<CommissionedPlant>, Failure> {
    let snippets = (numbers.end - numbers.start).saturating_mul(campaign.snippets_per_plant());
    let progress = Progress::of_snippets("commissioning", snippets);
    let mut plants = Vec::new();
    for number in numbers {
        if stop.load(Ordering::Relaxed) {
            break;
        }
        let plant = campaign.commission(number, jobs.count(), &|| progress.advance());
        plants.push(plant.map_err(|error| unusable(&error))?);
    }
    progress.end();
    Ok(plants)
}

/// Goes through cases, several at a time; what came of them is in their order. Fewer if it was stopped.
pub(super) fn go_through<R: Send>(
    (what, numbers): (&'static str, &[u64]),
    jobs: JobsArguments,
    stop: &AtomicBool,
    run: impl Fn(u64) -> Result<R, StudyError> + Sync,
) -> Result<Vec<R>, Failure> {
    let progress = Progress::of_runs(what, numbers.len() as u64);
    let mut records = Vec::new();
    let done = |number: &u64, record| {
        records.push((*number, record));
        progress.advance();
        Ok(())
    };
    parallel::for_each(numbers, jobs.count(), stop, |number| run(*number), done)
        .map_err(|error| unusable(&error))?;
    progress.end();
    records.sort_by_key(|(number, _)| *number);
    Ok(records.into_iter().map(|(_, record)| record).collect())
}
