//! Where commands that take recorded tables find them: CSV files as `export` writes them, and recordings (MCAP).

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use ::replay::{ModuleRecord, RunRows, latest_setup};
use diagnosis::ModuleSetup;
use vocabulary::{ModuleName, RunId};

use super::csv_table::TableText;
use crate::failure::Failure;
use crate::replay::read;

/// The text of a table, and how it is called in messages.
pub(crate) type NamedTable = (Box<dyn Read>, String);

/// Opens a CSV file.
pub(crate) fn open_csv(file: &Path) -> Result<NamedTable, Failure> {
    let opened = File::open(file).map_err(|error| Failure::unreadable(file, error))?;
    Ok((Box::new(opened), file.display().to_string()))
}

/// Is it a recording by its name?
pub(crate) fn is_recording(file: &Path) -> bool {
    file.extension().is_some_and(|extension| extension == "mcap")
}

/// Recordings, read as tables.
pub(crate) struct RecordedTables {
    name: String,
    records: Vec<Arc<ModuleRecord>>,
}

impl RecordedTables {
    /// Reads recordings, of which several are one.
    ///
    /// # Errors
    /// A recording that is damaged, or without one of these modules.
    pub(crate) fn read(files: &[PathBuf], setups: &[&ModuleSetup]) -> Result<Self, Failure> {
        let modules: Vec<ModuleName> = setups.iter().map(|setup| setup.module.clone()).collect();
        let reading = read(files, &modules)?;
        reading.complete()?;
        let name = files.first().map_or_else(String::new, |file| file.display().to_string());
        let name = if files.len() > 1 { format!("{name} and others") } else { name };
        let records: Vec<_> = reading.records.into_iter().map(Arc::new).collect();
        for module in &modules {
            let of_module = records.iter().filter(|record| record.module == *module);
            let structures: Vec<String> = of_module.map(|r| format!("`{}`", r.structure)).collect();
            if structures.len() > 1 {
                let structures = structures.join(", ");
                return Err(Failure::input(format!(
                    "{name}: several structures have a module `{module}`: {structures}; export the \
                     recording and give the tables of one"
                )));
            }
        }
        Ok(Self { name, records })
    }

    /// A recording of one module that measures readings, as a table of these.
    ///
    /// # Errors
    /// It has several modules or runs, or no configuration.
    pub(crate) fn readings(file: &Path, run: Option<RunId>) -> Result<NamedTable, Failure> {
        let recorded = Self::read(&[file.to_owned()], &[])?;
        let [record] = &recorded.records[..] else {
            let problem = "several modules in the recording; `export` it and give the table of one";
            return Err(Failure::input(format!("{}: {problem}", recorded.name)));
        };
        let setup = latest_setup(record)
            .map_err(|shortfall| Failure::input(format!("{}: {shortfall}", recorded.name)))?;
        recorded.samples(&setup, recorded.one_run(run)?)
    }

    /// The runs, of this number only if it is given.
    ///
    /// # Errors
    /// Nothing was found.
    pub(crate) fn runs(&self, wanted: Option<RunId>) -> Result<Vec<RunId>, Failure> {
        let heads = self.records.iter().flat_map(|record| {
            (0..record.samples.len()).filter_map(|index| record.samples.head(index))
        });
        let runs: BTreeSet<RunId> = heads.map(|head| head.run).collect();
        let chosen: Vec<RunId> =
            runs.iter().copied().filter(|run| wanted.is_none_or(|wanted| wanted == *run)).collect();
        if chosen.is_empty() {
            let known = if runs.is_empty() { "no sample".to_owned() } else { numbers(&runs) };
            let wanted = wanted.map_or_else(String::new, |run| format!("no run {run}; "));
            return Err(Failure::input(format!(
                "{}: {wanted}the recording has {known}",
                self.name
            )));
        }
        Ok(chosen)
    }

    /// The one run.
    ///
    /// # Errors
    /// No run was found, or several were and the caller chose none.
    pub(crate) fn one_run(&self, wanted: Option<RunId>) -> Result<RunId, Failure> {
        let runs = self.runs(wanted)?;
        let several = || {
            let runs = numbers(&runs.iter().copied().collect());
            let name = &self.name;
            Failure::usage(format!("{name}: the recording has {runs}; choose one with --run"))
        };
        if let [run] = runs[..] { Ok(run) } else { Err(several()) }
    }

    /// A run of one module without residuals.
    pub(crate) fn samples(&self, setup: &ModuleSetup, run: RunId) -> Result<NamedTable, Failure> {
        let record = self.record(setup)?;
        self.named(vec![RunRows::published(record, run, Some(setup))], run)
    }

    /// A run of some modules in one table, with the residuals of every step that diagnosers of these setups compute.
    pub(crate) fn residuals(
        &self,
        setups: &[&ModuleSetup],
        run: RunId,
    ) -> Result<NamedTable, Failure> {
        let rows = |setup: &&ModuleSetup| {
            RunRows::replayed(self.record(setup)?, run, setup)
                .map_err(|shortfall| Failure::input(format!("`{}`: {shortfall}", setup.module)))
        };
        self.named(setups.iter().map(rows).collect::<Result<_, _>>()?, run)
    }

    fn record(&self, setup: &ModuleSetup) -> Result<&Arc<ModuleRecord>, Failure> {
        let found = self.records.iter().find(|record| record.module == setup.module);
        found.ok_or_else(|| {
            Failure::input(format!("{}: no module `{}` in the recording", self.name, setup.module))
        })
    }

    fn named(&self, rows: Vec<RunRows>, run: RunId) -> Result<NamedTable, Failure> {
        Ok((Box::new(TableText::new(rows)?), format!("{}, run {run}", self.name)))
    }
}

fn numbers(runs: &BTreeSet<RunId>) -> String {
    let numbers: Vec<String> = runs.iter().map(ToString::to_string).collect();
    format!("run{} {}", if numbers.len() > 1 { "s" } else { "" }, numbers.join(", "))
}

/// The tables of all modules of one recorded run, in their order: of a recording, or of a directory with a table for
/// each module, `MODULE.csv` or, as `export` calls it, `MODULE-run-RUN.csv`, or else with recordings.
///
/// # Errors
/// A module's table is missing, or there are several.
pub(crate) fn tables_of_run(
    place: &Path,
    setups: &[ModuleSetup],
    run: Option<RunId>,
) -> Result<Vec<NamedTable>, Failure> {
    let mut files = vec![place.to_owned()];
    if !is_recording(place) {
        let unreadable = |error| Failure::unreadable(place, error);
        let entries = fs::read_dir(place).map_err(unreadable)?;
        let paths = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<PathBuf>, _>>();
        files = paths.map_err(unreadable)?;
        files.sort();
        let tables: Vec<_> = setups.iter().map(|s| tables_of_module(&files, &s.module)).collect();
        files.retain(|file| is_recording(file));
        if files.is_empty() || tables.iter().any(|tables| !tables.is_empty()) {
            return csv_tables(place, setups, tables, run);
        }
    }
    let recorded = RecordedTables::read(&files, &setups.iter().collect::<Vec<_>>())?;
    let run = recorded.one_run(run)?;
    setups.iter().map(|setup| recorded.samples(setup, run)).collect()
}

/// A table by its path, with the run in its name.
type TableFile = (PathBuf, Option<RunId>);

fn tables_of_module(files: &[PathBuf], module: &ModuleName) -> Vec<TableFile> {
    let table = |file: &PathBuf| {
        let rest = file.file_name()?.to_str()?.strip_prefix(module.as_str())?;
        let run = rest.strip_suffix(".csv")?;
        let run = match run.strip_prefix("-run-") {
            Some(number) => Some(RunId(number.parse().ok()?)),
            None if run.is_empty() => None,
            None => return None,
        };
        Some((file.clone(), run))
    };
    files.iter().filter_map(table).collect()
}

fn csv_tables(
    place: &Path,
    setups: &[ModuleSetup],
    tables: Vec<Vec<TableFile>>,
    wanted: Option<RunId>,
) -> Result<Vec<NamedTable>, Failure> {
    let here = place.display();
    let mut first: Option<(&ModuleName, RunId)> = None;
    let mut opened = Vec::new();
    for (setup, mut tables) in setups.iter().zip(tables) {
        let module = &setup.module;
        tables.retain(|(_, run)| run.is_none() || wanted.is_none_or(|wanted| *run == Some(wanted)));
        let (file, run) = match &tables[..] {
            [table] => table,
            [] => {
                let run = wanted.map_or_else(|| "RUN".to_owned(), |run| run.to_string());
                let problem = format!("not there; expected that table or `{module}-run-{run}.csv`");
                return Err(Failure::unreadable(&place.join(format!("{module}.csv")), problem));
            }
            several => {
                let name = |(file, _): &TableFile| file.file_name().unwrap_or_default().to_owned();
                let names: Vec<String> =
                    several.iter().map(|table| format!("{}", name(table).display())).collect();
                return Err(Failure::usage(format!(
                    "{here}: several tables of `{module}`: {}; choose a run with --run, or give each run a directory",
                    names.join(", ")
                )));
            }
        };
        match (first, run) {
            (Some((other, known)), Some(run)) if known != *run => {
                return Err(Failure::input(format!(
                    "{here}: the table of `{other}` is of run {known}, that of `{module}` of run {run}; give tables of \
                     the same run"
                )));
            }
            (None, Some(run)) => first = Some((module, *run)),
            _ => {}
        }
        opened.push(open_csv(file)?);
    }
    Ok(opened)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_found_by_module() {
        let names = ["m-run-7.csv", "m.csv", "m-run-x.csv", "m2.csv", "m-2-run-7.csv", "m.txt"];
        let files: Vec<PathBuf> = names.iter().map(|name| Path::new("d").join(name)).collect();
        let found = tables_of_module(&files, &"m".parse().unwrap());
        assert_eq!(found, [(files[0].clone(), Some(RunId(7))), (files[1].clone(), None)]);
        let found = tables_of_module(&files, &"m-2".parse().unwrap());
        assert_eq!(found, [(files[4].clone(), Some(RunId(7)))]);
    }
}
