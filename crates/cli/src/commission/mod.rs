//! `trusswatch commission`: references of healthy modules, from snippets that are simulated or recorded.

mod arguments;
mod columns;
mod modules;
mod recorded;
mod reference_files;

mod report;
mod simulated;
mod snippets_file;

use std::fs;

use daemon::config::PlantConfig;
use diagnosis::ModuleSetup;
use diagnosis::state::Snippet;
use serde_json::json;
use study::commissioning::{SnippetPlan, learn_all};

use crate::failure::Failure;
use crate::output;
use crate::progress::WorkProgress;
use report::ReferenceReport;

pub(crate) use arguments::Arguments;

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    arguments.check()?;
    let plant = arguments.simulation.load()?;
    let setups = modules::load(&arguments.modules, plant.as_ref())?;
    let mut snippets = snippets_file::read(&arguments.add, &setups)?;
    let earlier = snippets.len();
    snippets.extend(new_snippets(arguments, plant.as_ref(), &setups, &snippets)?);
    let rate = arguments.false_alarms_per_hour;
    let progress = WorkProgress::new("learning", "references", setups.len() as u64);
    let (jobs, done) = (arguments.simulation.jobs(), || progress.advance());
    let references = learn_all(&setups, &snippets, rate, jobs, &done)
        .map_err(|(module, error)| Failure::input(format!("`{module}`: {error}")))?;
    drop(progress);
    fs::create_dir_all(&arguments.out).map_err(|error| {
        Failure::runtime(format!("cannot make {}: {error}", arguments.out.display()))
    })?;
    snippets_file::write(&arguments.out, &setups, &snippets)?;
    let files = reference_files::write(arguments, &references)?;
    let modules: Vec<ReferenceReport<'_>> = (setups.iter().zip(&references).zip(&files))
        .map(|((setup, reference), file)| ReferenceReport { setup, reference, file })
        .collect();
    output::print(&if arguments.json {
        output::text(&json!({
            "snippets": snippets.len(),
            "earlier_snippets": earlier,
            "modules": modules.iter().map(ReferenceReport::document).collect::<Vec<_>>(),
        }))?
    } else {
        modules.iter().map(ReferenceReport::text).collect()
    })
}

fn new_snippets(
    arguments: &Arguments,
    plant: Option<&PlantConfig>,
    setups: &[ModuleSetup],
    earlier: &[Snippet],
) -> Result<Vec<Snippet>, Failure> {
    let Some(plant) = plant else {
        let recordings = &arguments.recordings;
        snippets_file::check_new(earlier, recordings.iter().map(|path| recorded::label(path)))?;
        return recorded::read(recordings, &arguments.table, setups);
    };
    let plans = arguments.simulation.plans(setups);
    snippets_file::check_new(earlier, plans.iter().map(SnippetPlan::label))?;
    arguments.simulation.record(plant, setups, &plans)
}
