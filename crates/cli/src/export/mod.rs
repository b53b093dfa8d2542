//! `trusswatch export`: a recording as tables.

mod columns;
#[cfg(feature = "parquet")]
mod parquet_table;
mod verdicts;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use ::replay::{ModuleRecord, latest_setup};
use vocabulary::{ModuleName, RunId, Step};

use crate::failure::Failure;
use crate::replay::read;
use columns::TableColumns;

/// Write a recording as tables (CSV, or Parquet in a build for it), for pandas, MATLAB or a spreadsheet
///
/// One table for each module and run, `MODULE-run-RUN`: a row for each step with demands, pressures and elongations by
/// component, and, where they were published, residuals and divergences. Besides, `verdicts.csv`. Numbers come back as
/// the very same bits; what is missing is empty.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Recordings, made by `trusswatch record`; several are one
    #[arg(required = true, value_name = "FILE.mcap")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    places: TableDirectories,
    /// Only these modules
    #[arg(long = "module", value_name = "MODULE", num_args = 1.., value_delimiter = ',')]
    modules: Vec<ModuleName>,
}

/// Where the tables go.
#[derive(Debug, clap::Args)]
#[group(required = true, multiple = true)]
struct TableDirectories {
    /// Directory for tables as CSV; made if it is not there
    #[arg(long, value_name = "DIR")]
    csv: Option<PathBuf>,
    /// Directory for tables as Parquet, `verdicts.csv` beside them; made if it is not there
    #[cfg(feature = "parquet")]
    #[arg(long, value_name = "DIR")]
    parquet: Option<PathBuf>,
}

/// A file format for tables.
#[derive(Debug, Clone, Copy)]
enum TableFormat {
    Csv,
    #[cfg(feature = "parquet")]
    Parquet,
}

impl TableFormat {
    fn extension(self) -> &'static str {
        match self {
            TableFormat::Csv => "csv",
            #[cfg(feature = "parquet")]
            TableFormat::Parquet => "parquet",
        }
    }
}

impl TableDirectories {
    fn each(&self) -> Vec<(TableFormat, &Path)> {
        let mut places = Vec::new();
        places.extend(self.csv.as_deref().map(|directory| (TableFormat::Csv, directory)));
        #[cfg(feature = "parquet")]
        places.extend(self.parquet.as_deref().map(|directory| (TableFormat::Parquet, directory)));
        places
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let reading = read(&arguments.files, &arguments.modules)?;
    let mut written = Vec::new();
    for (form, directory) in arguments.places.each() {
        written.extend(write_all(form, directory, &reading.records)?);
    }
    let mut out = io::stdout().lock();
    for (file, rows) in written {
        writeln!(out, "{}: {rows} rows", file.display())?;
    }
    out.flush()?;
    reading.complete()
}

/// Writes the files; returns their paths and numbers of rows.
fn write_all(
    form: TableFormat,
    directory: &Path,
    records: &[ModuleRecord],
) -> Result<Vec<(PathBuf, usize)>, Failure> {
    fs::create_dir_all(directory).map_err(|error| Failure::unwritable(directory, error))?;
    let structures: BTreeSet<_> = records.iter().map(|record| &record.structure).collect();
    let mut written = Vec::new();
    for record in records {
        let prefix = match structures.len() {
            1 => record.module.to_string(),
            _ => format!("{}-{}", record.structure, record.module),
        };
        for (run, rows) in runs(record) {
            let file = directory.join(format!("{prefix}-run-{run}.{}", form.extension()));
            write_run(form, &file, record, (run, &rows))
                .map_err(|error| Failure::unwritable(&file, error))?;
            written.push((file, rows.len()));
        }
    }
    let file = directory.join("verdicts.csv");
    let count =
        verdicts::write(&file, records).map_err(|error| Failure::unwritable(&file, error))?;
    written.push((file, count));
    Ok(written)
}

/// The indices of the samples of each run, in order.
fn runs(record: &ModuleRecord) -> BTreeMap<RunId, Vec<usize>> {
    let mut runs: BTreeMap<RunId, Vec<usize>> = BTreeMap::new();
    for index in 0..record.samples.len() {
        if let Some(head) = record.samples.head(index) {
            runs.entry(head.run).or_default().push(index);
        }
    }
    runs
}

fn write_run(
    form: TableFormat,
    file: &Path,
    record: &ModuleRecord,
    (run, rows): (RunId, &[usize]),
) -> io::Result<()> {
    let setup = latest_setup(record).ok();
    let columns = TableColumns::new(record, rows.first().copied(), setup.as_ref());
    let divergences: BTreeMap<Step, &vocabulary::Divergences> = record
        .divergences
        .iter()
        .filter(|message| message.run == run)
        .map(|message| (message.step, message))
        .collect();
    let rows = rows.iter().filter_map(|&index| {
        let head = record.samples.head(index)?;
        columns.row(record, index, divergences.get(&head.step).copied())
    });
    let names = columns.values();
    match form {
        TableFormat::Csv => columns::write_csv(file, &names, rows),
        #[cfg(feature = "parquet")]
        TableFormat::Parquet => parquet_table::write(file, &names, rows),
    }
}
