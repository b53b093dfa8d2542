//! Is the kind of a fault right, and its size?

mod arguments;
mod report;

use std::sync::atomic::AtomicBool;

use study::StudyError;
use study::conditions::ConditionCampaign;
use study::figure::identification_figure;
use study::identification::{IdentificationCase, IdentificationTally, run_case};

use super::drawn_plants::{commission, go_through};
use super::files;
use crate::failure::Failure;

pub(super) use arguments::Arguments;
use report::Report;

pub(super) fn run(arguments: &Arguments, stop: &AtomicBool) -> Result<(), Failure> {
    let (campaign, asked) = (arguments.campaign()?, arguments.asked()?);
    let plants = commission(&campaign, 0..arguments.drawn.plants.get(), arguments.jobs, stop)?;
    let numbers: Vec<u64> = (0..plants.len() as u64 * arguments.cases.get()).collect();
    let ConditionCampaign { structure, parameters, seed, .. } = &campaign;
    let records = go_through(("faults", &numbers), arguments.jobs, stop, |number| {
        let plant = &plants[campaign.plant_of(number) as usize];
        let case = IdentificationCase::draw(asked, structure, parameters.step_s, *seed, number)
            .ok_or(StudyError::NothingToBreak)?;
        run_case(&plant.site, &plant.setups, &case)
    })?;
    let expected = arguments.drawn.plants.get() * arguments.cases.get();
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
