//! `trusswatch export`: a recording as tables.

mod csv_table;
#[cfg(feature = "parquet")]
mod parquet_table;
mod tables;
mod verdicts;

use std::collections::BTreeSet;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use ::replay::{ModuleRecord, RunRows, latest_setup};
use vocabulary::{ModuleName, RunId};

use crate::failure::Failure;
use crate::output;
use crate::replay::read;
pub(crate) use csv_table::number;
pub(crate) use tables::{NamedTable, RecordedTables, is_recording, open_csv, tables_of_run};

/// How tables come by the residuals that they lack.
pub(crate) const RESIDUALS: &str =
    "`trusswatch export FILE.mcap --csv DIR --residuals` writes the residuals of a recording";

/// Write a recording as tables (CSV, or Parquet in a build for it), for pandas, MATLAB or a spreadsheet
///
/// One table for each module and run, `MODULE-run-RUN`: a row for each step with demands, pressures and elongations by
/// component, and, where they were published, residuals and divergences. Columns are named by component and signal, such
/// as `module1/actuator/a1/demand_n` or `module1/sensor/g5/residual`. Besides, `verdicts.csv`. Numbers come back as the
/// very same bits; what is missing is empty. `commission`, `calibrate` and `detect` read these tables; the last two need
/// `--residuals`.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Recordings, made by `trusswatch record`; several are one
    #[arg(required = true, value_name = "FILE.mcap")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    places: TableDirectories,
    /// Write residuals and divergences at every step: the samples go through a diagnoser with the recorded
    /// configuration, which starts with the first recorded step of the run
    #[arg(long)]
    residuals: bool,
    /// Write what each gage reads at every step, or should have read from the verdict on it on, with a 95 % interval: the
    /// recorded processes are replayed, without their peers' forces
    #[arg(long)]
    corrected: bool,
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
    let problems = reading.complete();
    let records: Vec<Arc<ModuleRecord>> = reading.records.into_iter().map(Arc::new).collect();
    let mut written = Vec::new();
    for (form, directory) in arguments.places.each() {
        let columns =
            MoreColumns { residuals: arguments.residuals, corrected: arguments.corrected };
        written.extend(write_all(form, directory, &records, columns)?);
    }
    let mut out = output::stdout();
    for (file, rows) in written {
        writeln!(out, "{}: {rows} rows", file.display())?;
    }
    out.flush()?;
    problems
}

/// Writes what each gage reads, or should have read, as tables in a directory.
pub(crate) fn write_corrected(directory: &Path, records: Vec<ModuleRecord>) -> Result<(), Failure> {
    let records: Vec<Arc<ModuleRecord>> = records.into_iter().map(Arc::new).collect();
    let columns = MoreColumns { residuals: false, corrected: true };
    write_all(TableFormat::Csv, directory, &records, columns).map(drop)
}

/// Columns besides what was published.
#[derive(Debug, Clone, Copy)]
struct MoreColumns {
    residuals: bool,
    corrected: bool,
}

/// Writes the files; returns their paths and numbers of rows.
fn write_all(
    form: TableFormat,
    directory: &Path,
    records: &[Arc<ModuleRecord>],
    columns: MoreColumns,
) -> Result<Vec<(PathBuf, usize)>, Failure> {
    fs::create_dir_all(directory).map_err(|error| Failure::unwritable(directory, error))?;
    let structures: BTreeSet<_> = records.iter().map(|record| &record.structure).collect();
    let mut written = Vec::new();
    for record in records {
        let prefix = match structures.len() {
            1 => record.module.to_string(),
            _ => format!("{}-{}", record.structure, record.module),
        };
        for (run, count) in record.runs() {
            let file = directory.join(format!("{prefix}-run-{run}.{}", form.extension()));
            let mut rows = rows(record, run, columns.residuals)?;
            if columns.corrected {
                rows = rows.with_corrected().map_err(|shortfall| {
                    Failure::input(format!(
                        "no corrected readings of `{}`: {shortfall}",
                        record.module
                    ))
                })?;
            }
            write_run(form, &file, rows).map_err(|error| Failure::unwritable(&file, error))?;
            written.push((file, count));
        }
    }
    let file = directory.join("verdicts.csv");
    let count =
        verdicts::write(&file, records).map_err(|error| Failure::unwritable(&file, error))?;
    written.push((file, count));
    Ok(written)
}

fn rows(record: &Arc<ModuleRecord>, run: RunId, residuals: bool) -> Result<RunRows, Failure> {
    let setup = latest_setup(record);
    if !residuals {
        return Ok(RunRows::published(record, run, setup.ok().as_ref()));
    }
    let rows = setup.and_then(|setup| RunRows::replayed(record, run, &setup));
    rows.map_err(|shortfall| {
        Failure::input(format!("no residuals of `{}`: {shortfall}", record.module))
    })
}

fn write_run(form: TableFormat, file: &Path, rows: RunRows) -> io::Result<()> {
    let names = rows.names();
    match form {
        TableFormat::Csv => csv_table::write(file, &names, rows),
        #[cfg(feature = "parquet")]
        TableFormat::Parquet => parquet_table::write(file, &names, rows),
    }
}
