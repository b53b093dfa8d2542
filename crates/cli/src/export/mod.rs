//! `trusswatch export`: a recording as tables.

mod columns;
mod verdicts;

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use ::replay::{ModuleRecord, latest_setup};
use names::{ModuleName, RunId, Step};

use crate::failure::Failure;
use crate::replay::read;
use columns::Columns;

/// Write a recording as tables (CSV), for pandas, MATLAB or a spreadsheet
///
/// One table for each module and run, `MODULE-run-RUN.csv`: a row for each step with demands, pressures and elongations by
/// component, and, where they were published, residuals and divergences. Besides, `verdicts.csv`. Numbers come back as
/// the very same bits; what is missing is empty.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Recordings, made by `trusswatch record`; several are one
    #[arg(required = true, value_name = "FILE.mcap")]
    files: Vec<PathBuf>,
    /// Directory for the tables; made if it is not there
    #[arg(long, value_name = "DIR")]
    csv: PathBuf,
    /// Only these modules
    #[arg(long = "module", value_name = "MODULE", num_args = 1.., value_delimiter = ',')]
    modules: Vec<ModuleName>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let reading = read(&arguments.files, &arguments.modules)?;
    let directory = &arguments.csv;
    fs::create_dir_all(directory).map_err(|error| cannot_write(directory, &error))?;
    let structures: std::collections::BTreeSet<_> =
        reading.records.iter().map(|record| &record.structure).collect();
    let mut written = Vec::new();
    for record in &reading.records {
        let prefix = match structures.len() {
            1 => record.module.to_string(),
            _ => format!("{}-{}", record.structure, record.module),
        };
        for (run, rows) in runs(record) {
            let file = directory.join(format!("{prefix}-run-{run}.csv"));
            write_run(&file, record, run, &rows).map_err(|error| cannot_write(&file, &error))?;
            written.push((file, rows.len()));
        }
    }
    let file = directory.join("verdicts.csv");
    let count =
        verdicts::write(&file, &reading.records).map_err(|error| cannot_write(&file, &error))?;
    written.push((file, count));
    let mut out = io::stdout().lock();
    for (file, rows) in written {
        writeln!(out, "{}: {rows} rows", file.display())?;
    }
    out.flush()?;
    reading.complete()
}

fn cannot_write(file: &Path, error: &io::Error) -> Failure {
    Failure::runtime(format!("cannot write `{}`: {error}", file.display()))
}

/// The places of the samples of each run, in order.
fn runs(record: &ModuleRecord) -> BTreeMap<RunId, Vec<usize>> {
    let mut runs: BTreeMap<RunId, Vec<usize>> = BTreeMap::new();
    for index in 0..record.samples.len() {
        if let Some(head) = record.samples.head(index) {
            runs.entry(head.run).or_default().push(index);
        }
    }
    runs
}

fn write_run(file: &Path, record: &ModuleRecord, run: RunId, rows: &[usize]) -> io::Result<()> {
    let mut out = csv::Writer::from_writer(BufWriter::new(File::create(file)?));
    let setup = latest_setup(record).ok();
    let columns = Columns::new(record, rows.first().copied(), setup.as_ref());
    out.write_record(columns.heading())?;
    let divergences: BTreeMap<Step, &wire::Divergences> = record
        .divergences
        .iter()
        .filter(|message| message.run == run)
        .map(|message| (message.step, message))
        .collect();
    for &index in rows {
        let Some(head) = record.samples.head(index) else { continue };
        let row = columns.row(record, index, divergences.get(&head.step).copied());
        out.write_record(row)?;
    }
    out.flush()
}
