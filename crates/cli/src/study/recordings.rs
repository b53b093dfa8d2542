//! Recordings of a campaign's runs, for other detectors: one table a run, the truth, and what the
//! diagnosers themselves found to have changed.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use serde::Serialize;
use study::scenarios::{ScenarioCampaign, ScenarioRow};
use study::{Campaign, RecordedChange, StudyError, export, parallel};
use vocabulary::{
    ComponentPath,
    fault::{Fault, FaultKind},
};

use super::arguments::ExportArguments;
use super::conduct;
use super::files::{self, cannot_write};
use crate::failure::Failure;
use crate::output;
use crate::progress::WorkProgress;

/// What came of the runs, by their number.
type Recorded = BTreeMap<u64, (ScenarioRow, Vec<RecordedChange>)>;

/// A line of `truth.csv`. A nominal run has nothing in the last four columns.
#[derive(Serialize)]
struct TruthRow {
    file: String,
    number: u64,
    seed: u64,
    component: Option<ComponentPath>,
    kind: Option<FaultKind>,
    /// As `name=value`, separated by blanks.
    parameters: Option<String>,
    /// First step with the fault.
    onset: Option<u64>,
}

/// A line of `changes.csv`.
#[derive(Serialize)]
struct ChangeRow<'a> {
    file: String,
    component: &'a ComponentPath,
    step: u64,
}

/// What was left in a directory.
#[derive(Serialize)]
struct ExportedRecordings<'a> {
    directory: &'a Path,
    scenarios: u64,
    nominal_runs: u64,
    changes: usize,
}

/// Records every run that the arguments ask for, and prints what was written where.
pub(super) fn write(arguments: &ExportArguments) -> Result<(), Failure> {
    let (campaign, stop) = (arguments.of.campaign()?, conduct::stop_on_signal()?);
    let directory = arguments.directory.as_path();
    files::make(directory)?;
    let cases: Vec<u64> = (0..campaign.cases()).collect();
    let mut recorded = Recorded::new();
    let progress = WorkProgress::new("recordings", "runs", campaign.cases());
    let keep = |case: &u64, record| {
        recorded.insert(*case, record);
        progress.advance();
        Ok(())
    };
    let record = |case: &u64| record(&campaign, *case, arguments.readings, directory);
    parallel::for_each(&cases, arguments.jobs.count(), &stop, record, keep)?;
    write_truth(&campaign, directory, &recorded)?;
    write_changes(&campaign, directory, &recorded)?;
    if recorded.len() < cases.len() {
        let message = format!("interrupted after {} of {} recordings", recorded.len(), cases.len());
        return Err(Failure::interrupted(message));
    }
    let changes = recorded.values().map(|(_, changes)| changes.len()).sum();
    let (scenarios, nominal_runs) = (campaign.scenarios, campaign.nominal);
    output::print(&match arguments.json {
        true => output::line(&ExportedRecordings { directory, scenarios, nominal_runs, changes })?,
        false => format!(
            "{}: {scenarios} scenarios and {nominal_runs} nominal runs, a table each; the truth of \
             all in truth.csv, the {changes} changes that the diagnosers saw in changes.csv\n",
            directory.display()
        ),
    })
}

fn file_name(campaign: &ScenarioCampaign, case: u64) -> String {
    match case.checked_sub(campaign.scenarios) {
        None => format!("scenario-{case:05}.csv"),
        Some(number) => format!("nominal-{number:05}.csv"),
    }
}

fn record(
    campaign: &ScenarioCampaign,
    case: u64,
    readings: bool,
    directory: &Path,
) -> Result<(ScenarioRow, Vec<RecordedChange>), Failure> {
    let path = directory.join(file_name(campaign, case));
    let file = File::create(&path).map_err(|error| cannot_write(&path, &error))?;
    let mut out = BufWriter::new(file);
    let recorded = export(campaign, case, readings, &mut out).map_err(|error| match error {
        StudyError::Write(error) => cannot_write(&path, &error),
        error => error.into(),
    })?;
    out.flush().map_err(|error| cannot_write(&path, &error))?;
    Ok(recorded)
}

fn write_truth(
    campaign: &ScenarioCampaign,
    directory: &Path,
    recorded: &Recorded,
) -> Result<(), Failure> {
    let rows = recorded.iter().map(|(case, (record, _))| {
        let injection = record.injection.as_ref();
        TruthRow {
            file: file_name(campaign, *case),
            number: case.checked_sub(campaign.scenarios).unwrap_or(*case),
            seed: record.seed,
            component: injection.map(|of| of.component.clone()),
            kind: record.kind(),
            parameters: injection.map(|of| parameters(&of.fault)),
            onset: injection.map(|of| of.at.0),
        }
    });
    files::write_table(&directory.join("truth.csv"), rows)
}

fn parameters(fault: &Fault) -> String {
    let named = |(name, value): (&str, f64)| format!("{name}={value:e}");
    fault.parameters().into_iter().map(named).collect::<Vec<_>>().join(" ")
}

fn write_changes(
    campaign: &ScenarioCampaign,
    directory: &Path,
    recorded: &Recorded,
) -> Result<(), Failure> {
    let rows = recorded.iter().flat_map(|(case, (_, changes))| {
        changes.iter().map(|change| ChangeRow {
            file: file_name(campaign, *case),
            component: &change.component,
            step: change.step.0,
        })
    });
    files::write_table(&directory.join("changes.csv"), rows)
}
