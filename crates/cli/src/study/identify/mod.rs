//! Is the kind of a fault right, and its size?

mod arguments;
mod report;

use std::sync::atomic::AtomicBool;

use study::conditions::{CommissionedPlant, ConditionCampaign};
use study::figure::identification_figure;
use study::identification::{
    IdentificationCase, IdentificationCases, IdentificationRecord, IdentificationTally, run_case,
};
use study::{StudyError, parallel};

use super::commissioned::commission;
use super::files;
use super::runs::unusable;
use crate::failure::Failure;
use crate::progress::Progress;

pub(super) use arguments::Arguments;
use report::Report;

pub(super) fn run(arguments: &Arguments, stop: &AtomicBool) -> Result<(), Failure> {
    let (campaign, asked) = (arguments.campaign()?, arguments.asked()?);
    let plants = commission(&campaign, 0..arguments.plants.get(), arguments.jobs, stop)?;
    let numbers: Vec<u64> = (0..plants.len() as u64 * arguments.cases.get()).collect();
    let records = go_through(arguments, (&campaign, asked), &plants, &numbers, stop)?;
    let expected = arguments.plants.get() * arguments.cases.get();
    let complete = records.len() as u64 == expected;
    let tally = IdentificationTally::of(&records);
    Report::of(arguments, &tally, &records, complete).print(arguments.json)?;
    if let Some(file) = &arguments.svg {
        files::write(file, identification_figure(&tally))?;
    }
    if complete {
        return Ok(());
    }
    Err(Failure::interrupted(format!("interrupted after {} of {expected} faults", records.len())))
}

/// Goes through cases, several at a time; they come back in their order.
fn go_through(
    arguments: &Arguments,
    (campaign, asked): (&ConditionCampaign, IdentificationCases),
    plants: &[CommissionedPlant],
    numbers: &[u64],
    stop: &AtomicBool,
) -> Result<Vec<IdentificationRecord>, Failure> {
    let progress = Progress::of_runs("faults", numbers.len() as u64);
    let mut records = Vec::new();
    let work = |number: &u64| {
        let plant = &plants[campaign.plant_of(*number) as usize];
        let ConditionCampaign { structure, parameters, seed, .. } = campaign;
        let case = IdentificationCase::draw(asked, structure, parameters.step_s, *seed, *number)
            .ok_or(StudyError::NothingToBreak)?;
        run_case(&plant.site, &plant.setups, &case)
    };
    let done = |_: &u64, record| {
        records.push(record);
        progress.advance();
        Ok(())
    };
    parallel::for_each(numbers, arguments.jobs.count(), stop, work, done)
        .map_err(|error| unusable(&error))?;
    progress.end();
    records.sort_by_key(|record| record.number);
    Ok(records)
}
