//! `trusswatch learn`: a module's reference from recordings of the healthy structure, without a structural model.

use std::path::{Path, PathBuf};

use diagnosis::state::learned::{
    CleanedInterval, HealthyRecording, LEARNED_HEADING, LearnedChannel, LearningSettings, Learnt,
    learn,
};
use vocabulary::Signal;

use crate::export::{RecordedTables, is_recording, open_csv};
use crate::failure::Failure;
use crate::output;
use crate::table::{table, terminal_width};
use tables::{CsvRows, RowTimes, TableFlags};

/// Most rows that may be missing in a row.
const LONGEST_GAP: u64 = 1_000_000;

/// Learn from recordings what sensors read under which loads, for `detect --config`
///
/// FILES are tables (CSV, or what a logger or spreadsheet exports) of the healthy structure, or recordings (MCAP) of
/// `import` or `record`, with the same columns. --inputs are the loads as measured: forces, pressures, displacements that are imposed. --sensors
/// follow from them. Give at least three recordings, of different days, that cover the loads: what differs between
/// recordings shows only in several, and beyond the loads seen no sensor can be called normal.
///
/// Short faults in the recordings are found, left out and listed. Prints what the inputs explain of each sensor, and
/// the smallest displacement that will be found.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  trusswatch learn monday.csv tuesday.csv friday.csv --inputs F1,F2 --sensors e1,e2,e3,w1 --out bridge.toml
  trusswatch detect today.csv --config bridge.toml")]
pub(crate) struct Arguments {
    /// Tables of the healthy structure, a recording each
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Columns of the loads, separated by commas
    #[arg(long, value_name = "NAMES", value_delimiter = ',', required = true)]
    inputs: Vec<String>,
    /// Columns of the sensors, separated by commas
    #[arg(long, value_name = "NAMES", value_delimiter = ',', required = true)]
    sensors: Vec<String>,
    /// File to write
    #[arg(long, value_name = "MODULE.toml")]
    out: PathBuf,
    /// Seconds of which medians are compared, at least a row; shorter than a tenth of the period of the fastest load that
    /// matters
    #[arg(long, value_name = "SECONDS", default_value = "1", value_parser = seconds)]
    window: f64,
    /// Rows per second, if no column of times tells it
    #[arg(long, value_name = "HZ", value_parser = rate)]
    rate: Option<f64>,
    #[command(flatten)]
    table: TableFlags,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let names: Vec<String> =
        arguments.sensors.iter().chain(&arguments.inputs).map(|n| n.trim().to_owned()).collect();
    let read = |file: &PathBuf| read(file, &names, &arguments.table, arguments.rate);
    let (recordings, times): (Vec<HealthyRecording>, Vec<Option<RowTimes>>) =
        arguments.files.iter().map(read).collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
    let settings = LearningSettings { window_s: arguments.window, ..LearningSettings::default() };
    let learnt = learn(&recordings, &names, arguments.sensors.len(), settings)
        .map_err(|error| Failure::input(error.to_string()))?;
    let text =
        toml::to_string(&learnt.module).map_err(|error| Failure::runtime(error.to_string()))?;
    std::fs::write(&arguments.out, LEARNED_HEADING.to_owned() + &text)
        .map_err(|error| Failure::unwritable(&arguments.out, error))?;
    if arguments.json {
        return output::print(&output::text(&learnt.document())?);
    }
    output::print(&report(&learnt, &times, &arguments.out))
}

/// Reads a recording whole, its missing rows as missing samples, and when its rows are.
fn read(
    file: &Path,
    names: &[String],
    flags: &TableFlags,
    rate: Option<f64>,
) -> Result<(HealthyRecording, Option<RowTimes>), Failure> {
    let (mut rows, name) = open(file, names, flags)?;
    let mut channels = vec![Vec::new(); names.len()];
    let mut first = None;
    while let Some(row) = rows.next_row()? {
        let usable = row.problem.is_none();
        if let Some(problem) = row.problem.filter(|_| !flags.skip_bad) {
            return Err(Failure::input(format!("{name}, {problem}")));
        }
        let (step, values) = (row.step, row.values);
        let read = channels[0].len() as u64;
        let place = if usable { step - *first.get_or_insert(step) } else { read };
        check_gap(&name, place - read)?;
        for (channel, samples) in channels.iter_mut().enumerate() {
            samples.resize(place as usize, f64::NAN);
            samples.push(if usable { values[channel] } else { f64::NAN });
        }
    }
    rows.print_remarks();
    let step_s = step_s(&rows, rate)?;
    Ok((HealthyRecording { name, step_s, channels }, rows.times()))
}

/// Missing rows are kept as missing samples, so that a step or time that cannot be right must not ask for too many.
///
/// # Errors
/// More rows are missing than any recording lacks.
pub(crate) fn check_gap(name: &str, missing: u64) -> Result<(), Failure> {
    if missing <= LONGEST_GAP {
        return Ok(());
    }
    let problem = format!("{missing} rows are missing in a row, at most {LONGEST_GAP} may be");
    Err(Failure::input(format!(
        "{name}: {problem}; correct the steps or times, or split the table"
    )))
}

/// Opens a table with these columns, or the recording of a module that measures such readings.
pub(crate) fn open(
    file: &Path,
    names: &[String],
    flags: &TableFlags,
) -> Result<(CsvRows, String), Failure> {
    let (input, name) = match is_recording(file) {
        true => RecordedTables::readings(file, flags.run)?,
        false => open_csv(file)?,
    };
    let recorded = flags.with_time("time_s");
    let flags = if is_recording(file) { &recorded } else { flags };
    // As `export` names the column.
    let column = |header: &[String], name: &String| {
        let suffix = format!("/{name}/{}", Signal::Reading.suffix());
        let own = header.iter().find(|column| *column == name);
        own.or_else(|| header.iter().find(|column| column.ends_with(&suffix)))
            .unwrap_or(name)
            .clone()
    };
    let columns = |header: &[String]| names.iter().map(|name| column(header, name)).collect();
    let rows = CsvRows::open(input, name.clone(), flags, |header| Ok(Some(columns(header))))?;
    Ok((rows, name))
}

/// The time between two rows \[s\].
pub(crate) fn step_s(rows: &CsvRows, rate: Option<f64>) -> Result<f64, Failure> {
    let told = rate.map(f64::recip).or_else(|| rows.step_s());
    told.ok_or_else(|| {
        let name = rows.name();
        Failure::input(format!("{name}: no column of times tells the sampling rate; add --rate HZ"))
    })
}

/// A value of a channel in its unit, as fine as its range asks for.
pub(crate) fn reading(channel: &LearnedChannel, value: f64) -> String {
    let decimals = (3.0 - channel.range().log10().floor()).clamp(4.0, 20.0) as usize;
    format!("{value:.decimals$}")
}

fn report(learnt: &Learnt, times: &[Option<RowTimes>], out: &Path) -> String {
    let module = &learnt.module;
    let mut rows =
        table(&["channel", "", "lowest", "highest", "explained", "found from", "of its range"]);
    for (k, channel) in module.channels.iter().enumerate() {
        let explained = learnt.explained.get(k);
        let share = channel.smallest_found / channel.range();
        rows.add_row([
            channel.name.clone(),
            if k < module.sensors { "sensor" } else { "input" }.to_owned(),
            reading(channel, channel.lowest),
            reading(channel, channel.highest),
            explained
                .map_or_else(|| "-".to_owned(), |share| format!("{:.1} %", 100.0 * share.max(0.0))),
            reading(channel, channel.smallest_found),
            format!(
                "{:.0} %{}",
                100.0 * share,
                if channel.is_beyond_judging() { ", cannot be judged" } else { "" }
            ),
        ]);
    }
    rows.align_right(2..6);
    let (recordings, hours) = (module.recordings.len(), module.hours);
    let mut text = format!(
        "learnt from {recordings} recordings, {hours:.2} h, in windows of {} s\n{}\n\n",
        module.window_s,
        rows.text(terminal_width())
    );
    if recordings < 3 {
        text += "few recordings: loads and zeros of other days are unknown; learn from at least three\n";
    }
    for CleanedInterval { recording, channel, samples: (first, last) } in &learnt.cleaned {
        let place = module.recordings.iter().position(|name| name == recording);
        let times = place.and_then(|place| times[place].as_ref());
        let span = times.and_then(|times| times.span((*first as u64, *last as u64)));
        let span = span.map_or_else(String::new, |(from, to)| format!(" ({from} to {to})"));
        text += &format!(
            "{recording}: rows {first} to {last}{span} left out: `{channel}` looks faulty\n"
        );
    }
    text + &format!(
        "written to {}; next: trusswatch detect FILE --config {}\n",
        out.display(),
        out.display()
    )
}

fn seconds(text: &str) -> Result<f64, String> {
    positive(text, "seconds, at most 3600", 3600.0)
}

/// Parses a sampling rate \[Hz\].
pub(crate) fn rate(text: &str) -> Result<f64, String> {
    positive(text, "rows per second, at most 100000", 1e5)
}

fn positive(text: &str, what: &str, most: f64) -> Result<f64, String> {
    let number: f64 = text.parse().unwrap_or(f64::NAN);
    let right = number > 0.0 && number <= most;
    if right { Ok(number) } else { Err(format!("expected a number above 0 of {what}")) }
}
