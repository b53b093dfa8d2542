//! Snippets that were recorded: a directory each, with a table of samples for each module.

use std::fs::File;
use std::path::{Path, PathBuf};

use diagnosis::ModuleSetup;
use diagnosis::state::{Snippet, WindowMeans};
use study::StepOrder;
use study::commissioning::WindowCollector;
use vocabulary::Step;

use super::columns::SignalColumns;
use crate::csv_rows::CsvRows;
use crate::failure::Failure;

/// What a recording is called.
pub(super) fn label(directory: &Path) -> String {
    directory.display().to_string()
}

/// Reads recordings, one snippet each.
pub(super) fn read(
    directories: &[PathBuf],
    skip_bad: bool,
    setups: &[ModuleSetup],
) -> Result<Vec<Snippet>, Failure> {
    let snippet = |directory: &PathBuf| {
        let windows = |setup: &ModuleSetup| {
            read_table(&directory.join(format!("{}.csv", setup.module)), skip_bad, setup)
        };
        let modules = setups.iter().map(windows).collect::<Result<_, _>>()?;
        Ok(Snippet { label: label(directory), modules })
    };
    directories.iter().map(snippet).collect()
}

fn read_table(
    file: &Path,
    skip_bad: bool,
    setup: &ModuleSetup,
) -> Result<Vec<WindowMeans>, Failure> {
    let name = file.display().to_string();
    let opened = File::open(file).map_err(|error| Failure::unreadable(file, error))?;
    let mut collector =
        WindowCollector::new(setup).map_err(|error| Failure::input(error.to_string()))?;
    let mut columns = SignalColumns::default();
    let mut rows = CsvRows::new(opened, name.clone(), b',', |header| {
        columns = SignalColumns::find(header, setup)?;
        Ok(Some(columns.names()))
    })?;
    let (mut rows_before, mut last) = (0, None);
    while let Some(row) = rows.next_row()? {
        if let Some(problem) = row.problem {
            if !skip_bad {
                return Err(Failure::input(format!("{name}, {problem}")));
            }
        } else {
            let at_line =
                |wrong: String| Failure::input(format!("{name}, line {}: {wrong}", row.line));
            let sample = columns.sample(row.values, rows_before).map_err(at_line)?;
            check_order(&mut last, sample.step).map_err(|wrong| at_line(wrong.to_string()))?;
            collector.take(&sample);
        }
        rows_before += 1;
    }
    Ok(collector.finish())
}

fn check_order(last: &mut Option<Step>, step: Step) -> Result<(), StepOrder> {
    match last.replace(step).filter(|last| step <= *last) {
        Some(last) => Err(StepOrder { step: step.0, last: last.0 }),
        None => Ok(()),
    }
}
