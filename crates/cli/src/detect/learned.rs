//! Readings judged by a module that `learn` made.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use daemon::config::{load_diagnoser, load_learned};
use diagnosis::state::learned::{
    ChannelState, ChannelSummary, ChannelVerdict, FittedKind, LearnedChannel, LearnedJudge,
    LearnedModule,
};
use serde_json::{Map, Value, json};
use settings::SettingsFile;
use vocabulary::fault::FaultKind;

use super::arguments::Arguments;
use super::picture::Picture;
use crate::check::kind::FileKind;
use crate::export::number;
use crate::failure::Failure;
use crate::learn;
use crate::output;
use crate::table::{table, terminal_width};
use tables::CsvRows;

/// Rows by which the sampling rate is known.
const ROWS_FOR_RATE: usize = 200;

/// The learned module, if the configuration is one or a diagnoser's that names one.
///
/// # Errors
/// A file that cannot be read, or a learned module with mistakes.
pub(super) fn load(files: &[PathBuf]) -> Result<Option<LearnedModule>, Failure> {
    let [file] = files else { return Ok(None) };
    // What is nothing of the kind is read and complained of as a diagnoser's configuration.
    let Ok(document) = SettingsFile::read(file) else { return Ok(None) };
    if FileKind::of(file, &document.text) == Ok(FileKind::Learned) {
        return Ok(Some(load_learned(file)?));
    }
    if !document.has(&["learned"]) {
        return Ok(None);
    }
    let learned = load_diagnoser(file)?.module_setup().learned;
    Ok(learned.map(|module| LearnedModule::clone(&module)))
}

/// Judges a table.
pub(super) fn run(arguments: &Arguments, module: LearnedModule) -> Result<(), Failure> {
    let [file] = &arguments.files[..] else {
        return Err(Failure::usage("a learned module judges one table at a time; give one FILE"));
    };
    let names: Vec<String> = module.channels.iter().map(|channel| channel.name.clone()).collect();
    let (rows, name) = learn::open(file, &names, &arguments.table)?;
    let mut out = output::stdout();
    let mut report = LearnedReport {
        channels: &module.channels,
        names: &names,
        json: arguments.json,
        out: &mut out,
    };
    if !arguments.json {
        writeln!(report.out, "{name}: rows are counted from 0")?;
    }
    let judged = judge(arguments, &module, rows, &mut report);
    out.flush()?;
    judged
}

fn judge(
    arguments: &Arguments,
    module: &LearnedModule,
    mut rows: CsvRows,
    report: &mut LearnedReport<'_, impl Write>,
) -> Result<(), Failure> {
    let missing = vec![f64::NAN; report.names.len()];
    let corrected = arguments.corrected.as_deref();
    let mut corrected =
        corrected.map(|file| CorrectedTable::create(file, report.names)).transpose()?;
    let mut picture = arguments.svg.as_ref().map(|file| (Picture::new(), file));
    // Until the rate is known, rows wait.
    let mut waiting: Vec<Vec<f64>> = Vec::new();
    let mut judge: Option<LearnedJudge> = None;
    let mut next = None;
    let mut all = 0_u64;
    loop {
        let row = rows.next_row()?;
        let ended = row.is_none();
        if let Some(row) = row {
            let usable = row.problem.is_none();
            if let Some(problem) = row.problem.filter(|_| !arguments.table.skip_bad) {
                return Err(Failure::input(format!("{}, {problem}", rows.name())));
            }
            let values = if usable { row.values.to_vec() } else { missing.clone() };
            let step = if usable { row.step } else { next.unwrap_or(0) };
            let gap = next.map_or(0, |next: u64| step.saturating_sub(next));
            learn::check_gap(rows.name(), gap)?;
            (0..gap).for_each(|_| waiting.push(missing.clone()));
            waiting.push(values);
            next = Some(step + 1);
            all += 1;
        }
        if judge.is_none() && (ended || arguments.rate.is_some() || waiting.len() > ROWS_FOR_RATE) {
            let step_s = learn::step_s(&rows, arguments.rate)?;
            let complain = |problem: String| Failure::input(format!("{}: {problem}", rows.name()));
            module.check_step(step_s).map_err(complain)?;
            judge = Some(LearnedJudge::new(module.clone(), step_s));
        }
        if let Some(judge) = &mut judge {
            for sample in waiting.drain(..) {
                let verdicts = judge.take(&sample);
                verdicts.iter().try_for_each(|verdict| report.verdict(verdict, &rows))?;
                if let Some(corrected) = &mut corrected {
                    corrected.take(&sample, judge)?;
                }
                if let Some((picture, _)) = &mut picture {
                    picture.take(&sample, judge);
                    verdicts.iter().for_each(|verdict| picture.shade(verdict));
                }
            }
        }
        if ended {
            break;
        }
    }
    rows.print_remarks();
    let Some(judge) = judge.filter(|judge| judge.windows() > 0) else {
        let name = rows.name();
        return Err(Failure::input(format!(
            "{name}: nothing was judged: {all} rows are less than a window of {} s",
            module.window_s
        )));
    };
    let (verdicts, summary) = judge.finish();
    verdicts.iter().try_for_each(|verdict| report.verdict(verdict, &rows))?;
    if let Some((picture, file)) = &mut picture {
        verdicts.iter().for_each(|verdict| picture.shade(verdict));
        picture.write(file, rows.name(), report.names)?;
    }
    if let Some(corrected) = &mut corrected {
        corrected.finish()?;
    }
    report.summary(all, &summary)
}

/// What channels read, or should read.
struct CorrectedTable<'a> {
    file: &'a Path,
    out: csv::Writer<File>,
    row: u64,
}

impl<'a> CorrectedTable<'a> {
    fn create(file: &'a Path, names: &[String]) -> Result<Self, Failure> {
        let out = csv::Writer::from_path(file).map_err(|error| Failure::unwritable(file, error))?;
        let mut table = Self { file, out, row: 0 };
        let columns =
            |name| ["", "/corrected_low", "/corrected_high"].map(|end| format!("{name}{end}"));
        table.write(["row".to_owned()].into_iter().chain(names.iter().flat_map(columns)))?;
        Ok(table)
    }

    /// Takes a row that the judge has taken.
    fn take(&mut self, sample: &[f64], judge: &LearnedJudge) -> Result<(), Failure> {
        let cells = |(channel, value): (usize, &f64)| match judge.expected(channel) {
            Some([expected, within]) => [expected, expected - within, expected + within],
            None => match judge.state(channel) {
                ChannelState::Normal | ChannelState::Unknown => [*value, f64::NAN, f64::NAN],
                ChannelState::NoSignal | ChannelState::Faulty => [f64::NAN; 3],
            },
        };
        let cells = sample.iter().enumerate().flat_map(cells);
        let row = self.row.to_string();
        self.row += 1;
        self.write([row].into_iter().chain(cells.map(number)))
    }

    fn write(&mut self, cells: impl Iterator<Item = String>) -> Result<(), Failure> {
        let written = self.out.write_record(cells);
        written.map_err(|error| Failure::unwritable(self.file, error))
    }

    fn finish(&mut self) -> Result<(), Failure> {
        self.out.flush().map_err(|error| Failure::unwritable(self.file, error))
    }
}

struct LearnedReport<'a, W> {
    channels: &'a [LearnedChannel],
    names: &'a [String],
    json: bool,
    out: W,
}

impl<W: Write> LearnedReport<'_, W> {
    fn verdict(&mut self, verdict: &ChannelVerdict, rows: &CsvRows) -> Result<(), Failure> {
        let ChannelVerdict { channel, state, first, last, lasts, reason, fault } = verdict;
        let times = rows.times().and_then(|times| times.span((*first, *last)));
        if self.json {
            let mut document = verdict.document(self.names);
            if let Some((first, last)) = times {
                document["first_time"] = first.into();
                document["last_time"] = last.into();
            }
            write!(self.out, "{}", output::line(&json!({ "verdict": document }))?)?;
        } else {
            let end = if *lasts { ", the end" } else { "" };
            let what = channel
                .zip(*fault)
                .map(|(place, fault)| fault_words(&fault, &self.channels[place]));
            let what = what.map_or_else(String::new, |what| format!(": {what}"));
            let who = channel.map_or("all others", |channel| self.names[channel].as_str());
            let state = state.as_str().replace('_', " ");
            let times = times.map_or_else(String::new, |(from, to)| format!(" ({from} to {to})"));
            writeln!(
                self.out,
                "{who}: {state}, rows {first} to {last}{times}{end}{what}; {reason}"
            )?;
        }
        Ok(self.out.flush()?)
    }

    fn summary(&mut self, rows: u64, summaries: &[ChannelSummary]) -> Result<(), Failure> {
        let each = self.names.iter().zip(summaries);
        if self.json {
            let components: Map<String, Value> =
                each.map(|(name, one)| (name.clone(), one.document())).collect();
            let document = json!({ "summary": { "rows": rows, "components": components } });
            write!(self.out, "{}", output::line(&document)?)?;
            return Ok(());
        }
        let mut rows = table(&["channel", "worst state", "from row", "normal for"]);
        for (name, one) in each {
            let normal = format!("{:.1} %", 100.0 * one.normal);
            let state = one.state.as_str().replace('_', " ");
            rows.add_row([name.clone(), state, one.first.to_string(), normal]);
        }
        rows.align_right(2..4);
        Ok(writeln!(self.out, "\n{}", rows.text(terminal_width()))?)
    }
}

fn fault_words(fault: &FittedKind, channel: &LearnedChannel) -> String {
    let FittedKind { kind, decided, size, expected, within } = *fault;
    let reading = |value| learn::reading(channel, value);
    let size = size.value;
    let size = match kind {
        FaultKind::Drift => format!("drift of {} per second", reading(size)),
        FaultKind::Gain => format!("gain of {size:.3}"),
        FaultKind::Stuck => format!("stuck, off by {} at last", reading(size)),
        FaultKind::ZeroOutput => format!("zero output, off by {} at last", reading(size)),
        other => format!("{} of {}", other.words(), reading(size)),
    };
    let doubt = if decided { "" } else { " (kind not decided)" };
    let (expected, within) = (reading(expected), reading(within));
    format!("{size}{doubt}; at its end it should have read {expected} ± {within}")
}
