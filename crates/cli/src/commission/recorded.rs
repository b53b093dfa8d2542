//! Snippets that were recorded: a recording each, or a directory with a table of samples for each module.

use std::path::{Path, PathBuf};

use diagnosis::ModuleSetup;
use diagnosis::state::{Snippet, WindowMeans};
use study::commissioning::WindowCollector;

use super::columns::SignalColumns;
use crate::export::{NamedTable, tables_of_run};
use crate::failure::Failure;
use tables::{CsvRows, TableFlags};

/// What a recording is called.
pub(super) fn label(directory: &Path) -> String {
    directory.display().to_string()
}

/// Reads recordings, one snippet each.
pub(super) fn read(
    directories: &[PathBuf],
    flags: &TableFlags,
    setups: &[ModuleSetup],
) -> Result<Vec<Snippet>, Failure> {
    let snippet = |directory: &PathBuf| {
        let tables = tables_of_run(directory, setups, flags.run)?;
        let windows = |(setup, table)| read_table(table, flags, setup);
        let modules = setups.iter().zip(tables).map(windows).collect::<Result<_, _>>()?;
        Ok(Snippet { label: label(directory), modules })
    };
    directories.iter().map(snippet).collect()
}

fn read_table(
    (input, name): NamedTable,
    flags: &TableFlags,
    setup: &ModuleSetup,
) -> Result<Vec<WindowMeans>, Failure> {
    let mut collector =
        WindowCollector::new(setup).map_err(|error| Failure::input(error.to_string()))?;
    let mut columns = SignalColumns::default();
    let mut rows = CsvRows::open(input, name.clone(), flags, |header| {
        columns = SignalColumns::find(header, setup)?;
        Ok(Some(columns.names()))
    })?;
    while let Some(row) = rows.next_row()? {
        match row.problem {
            Some(problem) if !flags.skip_bad => {
                return Err(Failure::input(format!("{name}, {problem}")));
            }
            Some(_) => {}
            None => collector.take(&columns.sample(row.step, row.values)),
        }
    }
    rows.print_remarks();
    Ok(collector.finish())
}
