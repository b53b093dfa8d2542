//! Faults that no change shows: are they found once modules are compared with their references?

mod arguments;
mod report;
mod show;

use std::sync::atomic::AtomicBool;

use study::conditions::{CaseRecord, CommissionedPlant, ConditionCampaign, run_case};
use study::parallel;

use super::commissioned::commission;
use super::runs::unusable;
use crate::failure::Failure;
use crate::progress::Progress;

pub(super) use arguments::Arguments;
use report::Report;

pub(super) fn run(arguments: &Arguments, stop: &AtomicBool) -> Result<(), Failure> {
    let campaign = arguments.campaign()?;
    if arguments.show {
        let place = campaign.plant_of(arguments.from);
        let plants = commission(&campaign, place..place + 1, arguments.jobs, stop)?;
        let Some(plant) = plants.first() else { return Err(interrupted(0)) };
        return show::case(arguments, &campaign, plant);
    }
    let first = campaign.plant_of(arguments.from);
    let last = first.saturating_add(arguments.plants.get());
    let plants = commission(&campaign, first..last, arguments.jobs, stop)?;
    let numbers: Vec<u64> = (arguments.from..last * arguments.cases.get()).collect();
    let records = go_through(arguments, &campaign, &plants, &numbers, stop)?;
    let complete = records.len() == numbers.len();
    Report::of(arguments, &campaign, &plants, &records, complete).print(arguments.json)?;
    if !complete {
        return Err(interrupted(records.len()));
    }
    let mut defects = records.iter().filter(|record| !record.healthy_named.is_empty());
    match defects.next() {
        None => Ok(()),
        // Only peers know what is not a module's own fault.
        Some(_) if arguments.alone => Ok(()),
        Some(first) => Err(Failure::runtime(defect(arguments, first, 1 + defects.count()))),
    }
}

fn interrupted(cases: usize) -> Failure {
    Failure::interrupted(format!("interrupted after {cases} cases"))
}

/// Goes through cases, several at a time; they come back in their order.
fn go_through(
    arguments: &Arguments,
    campaign: &ConditionCampaign,
    plants: &[CommissionedPlant],
    numbers: &[u64],
    stop: &AtomicBool,
) -> Result<Vec<CaseRecord>, Failure> {
    let progress = Progress::of_runs("cases", numbers.len() as u64);
    let first = plants.first().map_or(0, |plant| plant.number);
    let mut records = Vec::new();
    let work = |number: &u64| {
        let plant = &plants[(campaign.plant_of(*number) - first) as usize];
        run_case(&plant.site, &plant.setups, &campaign.case(plant, *number)?, |_, _| {})
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

fn defect(arguments: &Arguments, first: &CaseRecord, count: usize) -> String {
    let names: Vec<String> =
        first.healthy_named.iter().map(|(component, _)| component.to_string()).collect();
    format!(
        "a healthy component was named in {count} of the cases, {} in case {}; see what happens there: `{}`",
        names.join(", "),
        first.number,
        arguments.to_show(first.number),
    )
}
