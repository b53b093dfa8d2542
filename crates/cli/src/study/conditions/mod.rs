//! Faults that no change shows: are they found once modules are compared with their references?

mod arguments;
mod report;
mod show;

use std::sync::atomic::AtomicBool;

use study::conditions::{CaseRecord, run_case};

use super::drawn_plants::{commission, go_through};
use crate::failure::Failure;

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
    let last = first.saturating_add(arguments.drawn.plants.get());
    let plants = commission(&campaign, first..last, arguments.jobs, stop)?;
    let numbers: Vec<u64> = (arguments.from..last * arguments.cases.get()).collect();
    let records = go_through(("cases", &numbers), arguments.jobs, stop, |number| {
        let plant = &plants[(campaign.plant_of(number) - first) as usize];
        run_case(&plant.site, &plant.setups, &campaign.case(plant, number)?, |_, _| {})
    })?;
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
