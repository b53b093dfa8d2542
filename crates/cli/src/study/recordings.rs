//! Recordings of a campaign's runs, for other detectors: one table a run, the truth, and what the
//! diagnosers themselves found to have changed.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::sync::atomic::AtomicBool;

use names::ComponentPath;
use serde::Serialize;
use study::{
    Campaign, Exported, NominalRecord, RecordedChange, ScenarioRecord, StudyError, TruthIndex,
    export_nominal, export_scenario, parallel,
};

use super::arguments::ExportArguments;
use super::files;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::versioned;

/// A run, by its number. Scenarios come before nominal runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Run {
    Scenario(u64),
    Nominal(u64),
}

/// A run that was recorded.
enum Recorded {
    Scenario(Exported<ScenarioRecord>),
    Nominal(Exported<NominalRecord>),
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
struct Written<'a> {
    directory: &'a Path,
    scenarios: u64,
    nominal_runs: u64,
    changes: usize,
}

/// Records every run that the arguments ask for, and prints what was written where.
pub(super) fn write(
    arguments: &ExportArguments,
    campaign: &Campaign,
    stop: &AtomicBool,
) -> Result<(), Failure> {
    let directory = arguments.directory.as_path();
    let asked = &arguments.common.runs;
    std::fs::create_dir_all(directory).map_err(|error| cannot_write(directory, &error))?;
    let runs: Vec<Run> = (0..asked.scenarios)
        .map(Run::Scenario)
        .chain((0..asked.nominal).map(Run::Nominal))
        .collect();
    let mut recorded = BTreeMap::new();
    let progress = Progress::of_runs("recordings", runs.len() as u64);
    let keep = |run: &Run, record| {
        recorded.insert(*run, record);
        progress.advance();
        Ok(())
    };
    let record = |run: &Run| run.record(campaign, directory);
    parallel::for_each(&runs, asked.jobs.count(), stop, record, keep)?;
    progress.end();
    write_truth(directory, &recorded)?;
    write_changes(directory, &recorded)?;
    if recorded.len() < runs.len() {
        let message = format!("interrupted after {} of {} recordings", recorded.len(), runs.len());
        return Err(Failure::interrupted(message));
    }
    let changes = recorded.values().map(|recorded| recorded.changes().len()).sum();
    let (scenarios, nominal_runs) = (asked.scenarios, asked.nominal);
    print(&Written { directory, scenarios, nominal_runs, changes }, arguments.common.json)
}

fn print(written: &Written, json: bool) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    if json {
        write!(out, "{}", versioned::line(written)?)?;
    } else {
        let Written { directory, scenarios, nominal_runs, changes } = written;
        writeln!(
            out,
            "{}: {scenarios} scenarios and {nominal_runs} nominal runs, a table each; the truth of \
             all in truth.csv, the {changes} changes that the diagnosers saw in changes.csv",
            directory.display()
        )?;
    }
    Ok(out.flush()?)
}

impl Run {
    fn file_name(self) -> String {
        match self {
            Run::Scenario(number) => format!("scenario-{number:05}.csv"),
            Run::Nominal(number) => format!("nominal-{number:05}.csv"),
        }
    }

    fn record(self, campaign: &Campaign, directory: &Path) -> Result<Recorded, Failure> {
        let path = directory.join(self.file_name());
        let file = File::create(&path).map_err(|error| cannot_write(&path, &error))?;
        let mut out = BufWriter::new(file);
        let recorded = match self {
            Run::Scenario(number) => {
                export_scenario(campaign, number, &mut out).map(Recorded::Scenario)
            }
            Run::Nominal(number) => {
                export_nominal(campaign, number, &mut out).map(Recorded::Nominal)
            }
        };
        let recorded = recorded.map_err(|error| match error {
            StudyError::Write(error) => cannot_write(&path, &error),
            error => super::runs::unusable(&error),
        })?;
        out.flush().map_err(|error| cannot_write(&path, &error))?;
        Ok(recorded)
    }
}

impl Recorded {
    fn changes(&self) -> &[RecordedChange] {
        match self {
            Recorded::Scenario(exported) => &exported.changes,
            Recorded::Nominal(exported) => &exported.changes,
        }
    }
}

fn write_truth(directory: &Path, recorded: &BTreeMap<Run, Recorded>) -> Result<(), Failure> {
    let path = directory.join("truth.csv");
    let text = || {
        let mut index = TruthIndex::begin(Vec::new())?;
        for (run, recorded) in recorded {
            match recorded {
                Recorded::Scenario(exported) => index.scenario(&run.file_name(), &exported.record),
                Recorded::Nominal(exported) => index.nominal(&run.file_name(), &exported.record),
            }?;
        }
        index.end()
    };
    files::write(&path, text().map_err(|error| cannot_write(&path, &error))?)
}

fn write_changes(directory: &Path, recorded: &BTreeMap<Run, Recorded>) -> Result<(), Failure> {
    let rows = recorded.iter().flat_map(|(run, recorded)| {
        recorded.changes().iter().map(|change| ChangeRow {
            file: run.file_name(),
            component: &change.component,
            step: change.step.0,
        })
    });
    files::write_table(&directory.join("changes.csv"), rows)
}

fn cannot_write(path: &Path, error: &std::io::Error) -> Failure {
    Failure::runtime(format!("cannot write `{}`: {error}", path.display()))
}
