//! Random histories: is anything healthy ever named?

use std::io::{self, Write};
use std::sync::atomic::AtomicBool;

use serde::Serialize;
use study::histories::{History, HistoryRecord, HistoryTally, Named, run_history};
use study::summary::{Found, Interval95};
use study::{Campaign, Controller, Occurrence, parallel};

use super::arguments::HistoriesArguments;
use super::runs::unusable;
use super::tables::Titled;
use super::{preset, tables};
use crate::failure::Failure;
use crate::progress::Progress;
use crate::table::terminal_width;
use crate::versioned;

/// What was asked for and what came of it.
#[derive(Serialize)]
struct HistoriesDocument<'a> {
    preset: &'a str,
    seed: u64,
    mismatch: f64,
    controllers: &'a [Controller],
    from: u64,
    complete: bool,
    all: &'a HistoryTally,
    healthy_named_95: Interval95,
    histories: &'a [HistoryRecord],
}

pub(super) fn run(
    arguments: &HistoriesArguments,
    campaign: &Campaign,
    stop: &AtomicBool,
) -> Result<(), Failure> {
    if arguments.show {
        return show(campaign, arguments.from);
    }
    let records = make(arguments, campaign, stop)?;
    let complete = records.len() as u64 == arguments.histories.get();
    let tally = HistoryTally::of(&records);
    let healthy: Vec<_> = records.iter().filter(|r| r.healthy().next().is_some()).collect();
    let mut out = io::stdout().lock();
    if arguments.json {
        let document = HistoriesDocument {
            preset: preset::name(&arguments.campaign),
            seed: campaign.seed,
            mismatch: campaign.mismatch,
            controllers: &campaign.controllers,
            from: arguments.from,
            complete,
            healthy_named_95: tally.healthy_named_95(),
            all: &tally,
            histories: &records,
        };
        write!(out, "{}", versioned::text(&document)?)?;
    } else {
        tables::write(&[table(&records, &tally)], terminal_width(), &mut out)?;
    }
    out.flush()?;
    if !complete {
        return Err(Failure::interrupted(format!("interrupted after {} histories", records.len())));
    }
    match healthy.first() {
        None => Ok(()),
        Some(first) => Err(Failure::runtime(defect(campaign, first, healthy.len()))),
    }
}

fn make(
    arguments: &HistoriesArguments,
    campaign: &Campaign,
    stop: &AtomicBool,
) -> Result<Vec<HistoryRecord>, Failure> {
    let count = arguments.histories.get();
    let numbers: Vec<u64> = (arguments.from..arguments.from + count).collect();
    let progress = Progress::of_runs("histories", count);
    let mut records = Vec::new();
    let work = |number: &u64| {
        let history = History::draw(campaign, *number)?;
        run_history(campaign, &history, |_, _| {})
    };
    let done = |_: &u64, record| {
        records.push(record);
        progress.advance();
        Ok(())
    };
    parallel::for_each(&numbers, arguments.jobs.count(), stop, work, done)
        .map_err(|error| unusable(&error))?;
    progress.end();
    records.sort_by_key(|record| record.number);
    Ok(records)
}

fn defect(campaign: &Campaign, first: &HistoryRecord, count: usize) -> String {
    let names: Vec<String> = first.healthy().map(|named| named.component.to_string()).collect();
    let controllers: Vec<String> = campaign.controllers.iter().map(ToString::to_string).collect();
    format!(
        "a healthy component was named in {count} of the histories, {} in history {}; see what happens there: \
         `trusswatch study histories --seed {} --mismatch {} --controllers {} --from {} --show`",
        names.join(", "),
        first.number,
        campaign.seed,
        campaign.mismatch,
        controllers.join(","),
        first.number,
    )
}

fn table(records: &[HistoryRecord], all: &HistoryTally) -> Titled {
    let mut rows: Vec<Vec<String>> = HistoryTally::by_pattern(records)
        .iter()
        .map(|(pattern, tally)| row(pattern.as_str(), tally))
        .collect();
    rows.push(row("all", all));
    let Interval95(_, bound) = all.healthy_named_95();
    Titled {
        title: "Random histories",
        note: format!("A healthy component is named in at most {:.3} % (95 %).", 100.0 * bound),
        heading: vec![
            "pattern",
            "histories",
            "healthy named",
            "first fault named",
            "later faults named",
            "not judged",
        ],
        rows,
    }
}

fn row(name: &str, tally: &HistoryTally) -> Vec<String> {
    let found = |found: &Found| format!("{} of {}", found.found, found.all);
    vec![
        name.to_owned(),
        tally.histories.to_string(),
        tally.healthy_named.to_string(),
        found(&tally.first_faults),
        found(&tally.later_faults),
        tally.unconfirmed.to_string(),
    ]
}

/// Prints what happens in one history, step by step.
fn show(campaign: &Campaign, number: u64) -> Result<(), Failure> {
    let history = History::draw(campaign, number).map_err(|error| unusable(&error))?;
    let mut out = io::stdout().lock();
    let pattern = history.pattern.as_str();
    writeln!(out, "history {number}, {pattern}, plant seed {}", history.seed)?;
    for injection in &history.injections {
        let until = injection.until.map_or_else(|| "the end".to_owned(), |step| step.to_string());
        let (at, kind) = (injection.at, injection.fault.kind().words());
        writeln!(out, "  {kind} of {} from step {at} to {until}", injection.component)?;
    }
    for ((step, place), disturbance) in &history.disturbances {
        let module = &campaign.setups[*place].module;
        writeln!(out, "  step {step}: {module} {disturbance:?}")?;
    }
    let mut failed = Ok(());
    let each_step = |occurrences: &[Occurrence]| {
        occurrences.iter().try_for_each(|occurrence| print(occurrence, &mut out))
    };
    let mut each_step = each_step;
    let record = run_history(campaign, &history, |_, occurrences| {
        if failed.is_ok() {
            failed = each_step(occurrences);
        }
    });
    let record = record.map_err(|error| unusable(&error))?;
    failed?;
    let healthy: Vec<&Named> = record.healthy().collect();
    match healthy.first() {
        None => Ok(()),
        Some(_) => Err(Failure::runtime(defect(campaign, &record, 1))),
    }
}

fn print(occurrence: &Occurrence, out: &mut impl Write) -> io::Result<()> {
    match occurrence {
        Occurrence::Change { module, change } => {
            let (step, ratio) = (change.step, change.ratio);
            writeln!(out, "step {step:>7}  change      {module}/{} {ratio:.1}", change.component)
        }
        Occurrence::Transition { module, transition } => {
            let diagnosis::Transition { decided, component, verdict, detection, .. } =
                transition.as_ref();
            writeln!(
                out,
                "step {decided:>7}  verdict     {module}/{component} {verdict:?} ({detection})"
            )
        }
        Occurrence::Question { .. } | Occurrence::Identified { .. } => Ok(()),
    }
}
