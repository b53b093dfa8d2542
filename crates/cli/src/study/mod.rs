//! `trusswatch study`: campaigns of random scenarios in one process.

mod arguments;
mod compare;
mod document;
mod explain;
mod files;
mod interrupt;
mod journal;
mod power;
mod preset;
mod recordings;
mod report;
mod runs;
mod tables;

use std::io::{self, Write};
use std::sync::atomic::AtomicBool;

use study::Campaign;
use study::summary::Summary;

pub(crate) use arguments::Arguments;
use document::Document;
use runs::Runs;

use crate::failure::Failure;

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let campaign = preset::campaign(arguments)?;
    if let Some(number) = arguments.scenario {
        return explain::tell(&campaign, number);
    }
    let stop = interrupt::listen()?;
    if let Some(directory) = &arguments.export_residuals {
        return recordings::write(arguments, &campaign, directory, &stop);
    }
    if arguments.compare {
        let combinations = compare::combinations(arguments, &campaign, &stop)?;
        return tell_comparison(arguments, &combinations);
    }
    study(arguments, &campaign, &stop)
}

/// Makes the campaign and tells what came of it, also of a part of it.
fn study(arguments: &Arguments, campaign: &Campaign, stop: &AtomicBool) -> Result<(), Failure> {
    let runs = runs::make(arguments, campaign, stop)?;
    let summary = Summary::of(&runs.scenarios, &runs.nominal, campaign.parameters.step_s);
    let power = match arguments.power.filter(|_| runs.complete) {
        Some(runs) => power::measure(arguments, campaign, runs, stop)?,
        None => None,
    };
    let complete = runs.complete && (arguments.power.is_none() || power.is_some());
    let document = Document::new(arguments, complete, &summary, power.as_deref()).text()?;
    let heading = heading(arguments, campaign, &runs);
    let tables = tables::tables(&summary, power.as_deref());
    let mut out = io::stdout().lock();
    if arguments.json {
        out.write_all(document.as_bytes())?;
    } else {
        writeln!(out, "{heading}")?;
        tables::write(&tables, &mut out)?;
        tables::tell_not_exact(&summary, &mut out)?;
    }
    out.flush()?;
    if let Some(directory) = &arguments.out {
        files::write_tables(directory, &runs)?;
        files::write(&directory.join("summary.json"), &document)?;
        report::leave(directory, &heading, campaign, &tables, power.as_deref())?;
    }
    if complete { Ok(()) } else { Err(interrupted(arguments, &runs)) }
}

fn interrupted(arguments: &Arguments, runs: &Runs) -> Failure {
    let done = runs.scenarios.len() + runs.nominal.len();
    let all = arguments.scenarios + arguments.nominal;
    let kept = match &arguments.out {
        Some(directory) => {
            format!("the same command goes on with what is in `{}`", directory.display())
        }
        None => "with `--out` it could be gone on with".to_owned(),
    };
    Failure::runtime(format!("interrupted after {done} of {all} runs; {kept}"))
}

fn heading(arguments: &Arguments, campaign: &Campaign, runs: &Runs) -> String {
    let ranges = &campaign.ranges;
    let seconds = runs.scenarios.len() as f64 * ranges.length_s
        + runs.nominal.len() as f64 * ranges.nominal_s;
    let hours = seconds / 3600.0;
    let truth = match arguments.mismatch {
        0.0 => "plant as believed".to_owned(),
        share => format!("plant within ±{} % of what is believed", 100.0 * share),
    };
    format!(
        "preset {}, seed {}, {truth}: {} scenarios and {} nominal runs, {hours:.2} h of the tower's time",
        preset::name(arguments),
        arguments.seed,
        runs.scenarios.len(),
        runs.nominal.len(),
    )
}

fn tell_comparison(
    arguments: &Arguments,
    combinations: &[compare::Combination],
) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    if arguments.json {
        serde_json::to_writer_pretty(&mut out, combinations)?;
        writeln!(out)?;
    } else {
        writeln!(out, "{}", tables::comparison(combinations))?;
    }
    Ok(out.flush()?)
}
