//! `trusswatch detect`: the detector, alone, on a table of numbers.

mod arguments;
mod channels;
mod detector;
mod leaving;
mod report;
mod tally;

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::Path;

use crate::csv_rows::CsvRows;
use crate::failure::Failure;

pub(crate) use arguments::Arguments;
use channels::DetectionPlan;
use detector::TableDetector;
use report::DetectionReport;
use tally::TableTally;

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let modules = channels::load(&arguments.modules, arguments.columns.as_deref())?;
    let columns = match &modules[..] {
        [] => arguments.columns.clone(),
        modules => Some(modules.iter().flat_map(|module| module.columns.clone()).collect()),
    };
    let (input, name) = open(&arguments.file)?;
    let rows = CsvRows::open(input, name, &arguments.table, |_| Ok(columns.clone()))?;
    let plan = match &modules[..] {
        [] => DetectionPlan::alike(arguments.group(rows.channels().len())),
        _ => DetectionPlan::of_modules(modules),
    };
    let mut out = io::BufWriter::new(io::stdout().lock());
    let judged = judge(arguments, &plan, rows, &mut out);
    // What was found up to a mistake is printed before the mistake.
    out.flush()?;
    judged
}

fn judge(
    arguments: &Arguments,
    plan: &DetectionPlan,
    mut rows: CsvRows,
    out: &mut impl Write,
) -> Result<(), Failure> {
    let channels = rows.channels();
    let mut detector = TableDetector::new(plan)?;
    let mut report = DetectionReport { arguments, plan, channels: &channels, out };
    let mut tally = TableTally::new(channels.len());
    while let Some(row) = rows.next_row()? {
        let usable = row.problem.is_none();
        if let Some(problem) = row.problem.filter(|_| !arguments.table.skip_bad) {
            return Err(Failure::input(format!("{}, {problem}", rows.name())));
        }
        let readings = detector.take(usable.then_some((row.step, row.values)));
        tally.take(usable, readings);
        report.row(tally.last_row(), usable, readings)?;
        if rows.is_drained() {
            report.flush()?;
        }
    }
    report.end(rows.name(), &tally)?;
    rows.print_remarks();
    warn_on_stderr(rows.name(), &channels, &tally);
    tally.check_judged(rows.name(), plan)
}

fn open(file: &Path) -> Result<(Box<dyn Read>, String), Failure> {
    if file == Path::new("-") {
        return Ok((Box::new(io::stdin().lock()), "standard input".to_owned()));
    }
    let name = file.display().to_string();
    match File::open(file) {
        Ok(opened) => Ok((Box::new(opened), name)),
        Err(error) => Err(Failure::unreadable(file, error)),
    }
}

/// Warnings, the same for every form of the output.
fn warn_on_stderr(name: &str, channels: &[String], tally: &TableTally) {
    let mut stderr = io::stderr().lock();
    // Standard error may be closed.
    if tally.bad_rows > 0 {
        let (bad, all) = (tally.bad_rows, tally.rows);
        let _ = writeln!(stderr, "{name}: {bad} of {all} rows were bad and count as gaps");
    }
    for (channel, of_channel) in channels.iter().zip(&tally.channels) {
        if let Some((violation, row)) = of_channel.first_restart {
            let times = of_channel.restarts;
            let _ = writeln!(
                stderr,
                "{name}: channel `{channel}` was restarted {times} times, first at row {row}: \
                 {violation}"
            );
        }
    }
}
