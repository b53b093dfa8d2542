//! `trusswatch detect`: the detector, alone, on a table of numbers.

mod arguments;
mod channels;
mod learned;
mod picture;
mod report;
mod tally;

use std::io::{self, Write};
use std::path::Path;

use diagnosis::detector::TableDetector;

use crate::export::{NamedTable, RecordedTables, is_recording, open_csv};
use crate::failure::Failure;
use crate::output;
use tables::CsvRows;

pub(crate) use arguments::Arguments;
use channels::{DetectionPlan, ModuleChannels};
use report::DetectionReport;
use tally::TableTally;

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    if let Some(module) = learned::load(&arguments.modules)? {
        return learned::run(arguments, module);
    }
    let learned_only = [("--svg", &arguments.svg), ("--corrected", &arguments.corrected)];
    if let Some((flag, _)) = learned_only.iter().find(|(_, file)| file.is_some()) {
        return Err(Failure::usage(format!(
            "{flag} is about what a learned module finds: give --config MODULE.toml of `learn`"
        )));
    }
    let modules = channels::load(&arguments.modules, arguments.columns.as_deref())?;
    let (input, name) = open(arguments, &modules)?;
    let rows = CsvRows::open(input, name, &arguments.table, |header| match &modules[..] {
        [] => Ok(arguments.columns.clone()),
        modules => channels::columns(modules, header).map(Some),
    })?;
    let components = modules.iter().flat_map(|module| &module.components).map(ToString::to_string);
    let (plan, channels) = match &modules[..] {
        [] => (DetectionPlan::alike(arguments.group(rows.channels().len())), rows.channels()),
        _ => (DetectionPlan::of_modules(&modules), components.collect()),
    };
    let mut out = io::BufWriter::new(output::stdout());
    let judged = judge(arguments, &plan, (rows, &channels), &mut out);
    // What was found up to a mistake is printed before the mistake.
    out.flush()?;
    judged
}

fn judge(
    arguments: &Arguments,
    plan: &DetectionPlan,
    (mut rows, channels): (CsvRows, &[String]),
    out: &mut impl Write,
) -> Result<(), Failure> {
    let mut detector =
        TableDetector::new(&plan.groups).map_err(|error| Failure::usage(error.to_string()))?;
    let mut report = DetectionReport { arguments, plan, channels, out };
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
    warn_on_stderr(rows.name(), channels, &tally);
    tally.check_judged(rows.name(), plan)
}

fn open(arguments: &Arguments, modules: &[ModuleChannels]) -> Result<NamedTable, Failure> {
    let files = &arguments.files;
    match &files[..] {
        [file] if file == Path::new("-") => {
            Ok((Box::new(io::stdin().lock()), "standard input".to_owned()))
        }
        [file] if !is_recording(file) => open_csv(file),
        _ => {
            if let Some(table) = files.iter().find(|file| !is_recording(file)) {
                let table = table.display();
                let problem = "give one table, or several files of one recording (MCAP)";
                return Err(Failure::usage(format!(
                    "`{table}` is one of several files; {problem}"
                )));
            }
            if modules.is_empty() {
                let problem = "of a recording, residuals are watched: give the module's --config";
                return Err(Failure::usage(problem));
            }
            let setups: Vec<_> = modules.iter().map(|module| &module.setup).collect();
            let recorded = RecordedTables::read(files, &setups)?;
            recorded.residuals(&setups, recorded.one_run(arguments.table.run)?)
        }
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
