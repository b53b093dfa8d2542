//! Plants that are commissioned before anything else.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use study::conditions::{CommissionedPlant, ConditionCampaign};

use super::arguments::JobsArguments;
use super::runs::unusable;
use crate::failure::Failure;
use crate::progress::Progress;

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
