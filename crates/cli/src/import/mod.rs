//! `trusswatch import`: tables of any loggers as one recording.

mod align;
mod map;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use diagnosis::ModuleSetup;
use diagnosis::messages::Speaker;
use recording::{Recorded, Writer};
use vocabulary::words::utc;
use vocabulary::{Sample, Step, Topic, encode};

use crate::export::{RecordedTables, is_recording, open_csv};
use crate::failure::Failure;
use crate::learn;
use crate::output;
use align::{LoggerTable, check_correlation, offset_s};
use map::{ImportMap, Source, proposal};
use tables::{CsvRows, TableFlags};

/// Make a recording (MCAP) of the tables of any loggers
///
/// DATA are tables (CSV, or what a logger or spreadsheet exports), or recordings of readings. The map says which column
/// is which signal, with unit, sign, offset and scale; --propose writes one to start from. Tables of several loggers and
/// rates come together on one step: a value is held until its table's next row is due, and what is missing stays
/// missing. Tables with dates are aligned by them; else the offset between clocks is given in the map, or estimated from a
/// column that all loggers measure.
///
/// `learn`, `detect`, `export`, `commission` and `replay` read the recording. For `replay --publish` to a learned module's
/// diagnoser the map has to name that one's configuration: samples then have its channels, in its order.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  trusswatch import forces.csv strains.csv --map bridge.map.toml --propose
  trusswatch import forces.csv strains.csv --map bridge.map.toml --out monday.mcap")]
pub(crate) struct Arguments {
    /// Tables, of one time each
    #[arg(required = true, value_name = "DATA")]
    files: Vec<PathBuf>,
    /// Which column is which signal
    #[arg(long, value_name = "MAP.toml")]
    map: PathBuf,
    /// Recording to write
    #[arg(long, value_name = "FILE.mcap", required_unless_present = "propose")]
    out: Option<PathBuf>,
    /// Write the map, with all columns as readings, for you to complete
    #[arg(long, conflicts_with = "out")]
    propose: bool,
    #[command(flatten)]
    table: TableFlags,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    match &arguments.out {
        None => propose(arguments),
        Some(out) => import(arguments, out),
    }
}

/// Opens a table with some columns, or with all.
fn open(file: &Path, columns: Option<&[String]>, flags: &TableFlags) -> Result<CsvRows, Failure> {
    if let Some(columns) = columns {
        return Ok(learn::open(file, columns, flags)?.0);
    }
    let (input, name) = match is_recording(file) {
        true => RecordedTables::readings(file, flags.run)?,
        false => open_csv(file)?,
    };
    Ok(CsvRows::open(input, name, flags, |_| Ok(None))?)
}

fn propose(arguments: &Arguments) -> Result<(), Failure> {
    let header = |file: &PathBuf| -> Result<(String, Vec<String>), Failure> {
        let rows = open(file, None, &arguments.table)?;
        Ok((file.display().to_string(), rows.channels()))
    };
    let tables: Vec<_> = arguments.files.iter().map(header).collect::<Result<_, _>>()?;
    let map = &arguments.map;
    let mut file =
        std::fs::File::create_new(map).map_err(|error| Failure::unwritable(map, error))?;
    std::io::Write::write_all(&mut file, proposal(&tables).as_bytes())
        .map_err(|error| Failure::unwritable(map, error))?;
    let columns = tables.iter().map(|(_, columns)| columns.len()).sum::<usize>();
    output::print(&format!("{}: {columns} columns; complete it, then import\n", map.display()))
}

fn import(arguments: &Arguments, out: &Path) -> Result<(), Failure> {
    let map = ImportMap::read(&arguments.map, arguments.files.len())?;
    let mut told = String::new();
    let mut tables: Vec<LoggerTable> = Vec::new();
    let mut wanted: Vec<Vec<String>> = Vec::new();
    for (place, (file, of_table)) in arguments.files.iter().zip(&map.tables).enumerate() {
        let own = map.sources.iter().filter(|source| source.table == place);
        let columns: BTreeSet<&String> =
            own.map(|source| &source.column).chain(&of_table.common).collect();
        let columns: Vec<String> = columns.into_iter().cloned().collect();
        if columns.is_empty() {
            let (file, map) = (file.display(), arguments.map.display());
            return Err(Failure::input(format!("{map}: no column of `{file}` is mapped")));
        }
        let flags = match &of_table.time {
            Some(time) => arguments.table.with_time(time),
            None => arguments.table.clone(),
        };
        let rows = open(file, Some(&columns), &flags)?;
        tables.push(LoggerTable::read(rows, (&flags, of_table), columns.len())?);
        wanted.push(columns);
    }
    let finest = tables.iter().map(|table| table.step_s).fold(f64::INFINITY, f64::min);
    let step_s = map.step_s.unwrap_or(finest);
    let common = |place: usize| {
        let name = map.tables[place].common.as_ref()?;
        wanted[place].iter().position(|column| column == name)
    };
    for place in 1..tables.len() {
        if map.tables[place].offset_s.is_some() {
            continue;
        }
        let Some((first, own)) = common(0).zip(common(place)) else {
            tables[place].begins_s = tables[place].dated_after(&tables[0])?;
            continue;
        };
        let names = (&tables[0].name, &tables[place].name);
        let fail = |why: String| Failure::input(format!("{}: clock offset: {why}", names.1));
        let (offset, correlation) =
            offset_s((&tables[0], first), (&tables[place], own), finest).map_err(fail)?;
        check_correlation(correlation).map_err(fail)?;
        let (one, other) = names;
        told += &format!(
            "{other} begins {offset:+.4} s after {one}, by the common column (correlation {correlation:.3}, told to \
             {finest:.4} s)\n"
        );
        tables[place].begins_s = offset;
    }
    let places: Vec<(usize, &Source)> = map
        .sources
        .iter()
        .map(|source| {
            let columns = &wanted[source.table];
            (columns.iter().position(|column| *column == source.column).unwrap_or(0), source)
        })
        .collect();
    // What all tables cover.
    let begins = tables.iter().map(|table| table.begins_s).fold(f64::NEG_INFINITY, f64::max);
    let ends = tables.iter().map(LoggerTable::ends_s).fold(f64::INFINITY, f64::min);
    let steps = ((ends - begins) / step_s + 1e-6).floor().max(0.0) as u64;
    if steps == 0 {
        let span = |table: &LoggerTable| {
            format!("{} from {:.1} to {:.1} s", table.name, table.begins_s, table.ends_s())
        };
        let spans: Vec<String> = tables.iter().map(span).collect();
        let spans = spans.join(", ");
        return Err(Failure::input(format!(
            "the tables have no time in common: {spans}; check their dates, or give `offset_s`"
        )));
    }
    let dated = tables[0].began_unix_s.filter(|_| map.start_unix_ns.is_none());
    let began_s = dated.map_or(0.0, |(first_s, _)| first_s + begins);
    let start_unix_ns =
        map.start_unix_ns.unwrap_or((began_s.max(0.0) * 1e3).round() as u64 * 1_000_000);
    if let Some((_, is_zoned)) = dated {
        let zone = if is_zoned { "" } else { "; its times name no zone and are taken for UTC" };
        told += &format!("it begins at {}{zone}\n", utc(start_unix_ns));
    } else if map.start_unix_ns.is_none() {
        let (map, begins) = (arguments.map.display(), utc(start_unix_ns));
        told += &format!(
            "no time has a date: it begins at {begins}; give `start` in {map} if that matters\n"
        );
    }
    let values = (0..steps).map(|k| align::sample(&tables, &places, begins + k as f64 * step_s));
    let missing = write(&map, out, (step_s, start_unix_ns), values)?;
    let (count, seconds) = (places.len(), steps as f64 * step_s);
    told += &format!(
        "{}: {steps} samples of {count} signals, {seconds:.1} s at {:.4} Hz; {missing} values missing\n",
        out.display(),
        step_s.recip()
    );
    output::print(&told)
}

/// Writes the recording; returns how many values are missing in it.
fn write(
    map: &ImportMap,
    out: &Path,
    (step_s, start): (f64, u64),
    values: impl Iterator<Item = Vec<f64>>,
) -> Result<u64, Failure> {
    let setup = ModuleSetup { step_s: own_step(map, step_s)?, ..map.setup.clone() };
    let speaker = Speaker::of(map.structure.clone(), setup.module.clone());
    let unwritable = |error: recording::RecordingError| Failure::runtime(error.to_string());
    let mut writer = Writer::create(out).map_err(unwritable)?;
    let software = env!("CARGO_PKG_VERSION");
    let configuration = speaker.configuration(&setup, software, &map.thresholds, start)?;
    let bytes = |error: vocabulary::EncodeError| Failure::runtime(error.to_string());
    let payload = encode(&configuration).map_err(bytes)?;
    let recorded = Recorded::received(speaker.key(Topic::Configuration), payload, start);
    writer.write(&recorded).map_err(unwritable)?;
    let key = speaker.key(Topic::Sample);
    let mut missing = 0;
    for (step, values) in (0..).zip(values) {
        missing += values.iter().filter(|value| !value.is_finite()).count() as u64;
        let time_unix_ns = start + (step as f64 * step_s * 1e9).round() as u64;
        let sample = sample(map, (Step(step), time_unix_ns), &values);
        let payload = encode(&sample).map_err(bytes)?;
        let recorded = Recorded::received(key.clone(), payload, time_unix_ns);
        writer.write(&recorded).map_err(unwritable)?;
    }
    writer.finish().map_err(unwritable)?;
    Ok(missing)
}

/// The step of the recording; a diagnoser's configuration must have the same.
fn own_step(map: &ImportMap, step_s: f64) -> Result<f64, Failure> {
    let own = map.setup.step_s;
    if !map.setup.readings.is_empty() {
        return Ok(step_s);
    }
    if (own - step_s).abs() <= 1e-6 * own {
        return Ok(own);
    }
    Err(Failure::input(format!(
        "the configuration has `step_s` = {own}, the recording {step_s}; set `step_s` of the map to {own}"
    )))
}

fn sample(map: &ImportMap, (step, time_unix_ns): (Step, u64), values: &[f64]) -> Sample {
    let (demands, rest) = values.split_at(map.actuators);
    let (pressures, measured) = rest.split_at(2 * map.actuators);
    let (pairs, _) = pressures.as_chunks::<2>();
    let (readings, elongations) =
        if map.setup.measures_readings() { (measured, &[][..]) } else { (&[][..], measured) };
    Sample {
        module: map.setup.module.clone(),
        run: map.run,
        step,
        time_unix_ns,
        demands_n: demands.to_vec(),
        pressures_pa: pairs.to_vec(),
        elongations_m: elongations.to_vec(),
        readings: readings.to_vec(),
        block: Vec::new(),
    }
}
