//! `trusswatch study`: campaigns of random scenarios in one process.

mod arguments;
mod compare;
mod conditions;
mod document;
mod drawn_plants;
mod explain;
mod files;
mod histories;
mod identify;
mod interrupt;
mod journal;
mod limits;
mod power;
mod preset;
mod recordings;
mod report;
mod runs;
mod tables;
mod weather;

use std::io::{self, Write};

use study::Campaign;
use study::summary::Summary;

pub(crate) use arguments::Arguments;
use arguments::{
    Command, CommonArguments, CompareArguments, ExplainArguments, ExportArguments, RunArguments,
};
use document::Document;
use runs::{Kept, Runs};

use crate::failure::Failure;
use crate::versioned;

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    match &arguments.command {
        Command::Run(arguments) => run_campaign(arguments),
        Command::Power(arguments) => {
            let campaign = preset::campaign(&arguments.campaign)?;
            let stop = interrupt::listen()?;
            power::run(arguments, &campaign, &stop)
        }
        Command::Histories(arguments) => {
            let campaign = preset::campaign(&arguments.campaign)?;
            let stop = interrupt::listen()?;
            histories::run(arguments, &campaign, &stop)
        }
        Command::Conditions(arguments) => {
            let stop = interrupt::listen()?;
            conditions::run(arguments, &stop)
        }
        Command::Limits(arguments) => {
            let stop = interrupt::listen()?;
            limits::run(arguments, &stop)
        }
        Command::Identify(arguments) => {
            let stop = interrupt::listen()?;
            identify::run(arguments, &stop)
        }
        Command::Compare(arguments) => compare_rules(arguments),
        Command::Explain(ExplainArguments { scenario, campaign }) => {
            explain::print(&preset::campaign(campaign)?, *scenario)
        }
        Command::Export(arguments) => export(arguments),
    }
}

/// Makes the campaign and prints its results, also if interrupted.
fn run_campaign(arguments: &RunArguments) -> Result<(), Failure> {
    let CommonArguments { campaign: asked, runs, json } = &arguments.common;
    let campaign = preset::with_runs(&arguments.common)?;
    let preset = preset::name(asked);
    let kept = arguments.out.as_deref().map(|directory| Kept { directory, preset });
    let stop = interrupt::listen()?;
    let runs = runs::make(runs, &campaign, kept, &stop)?;
    let summary = Summary::of(&runs.scenarios, &runs.nominal, campaign.parameters.step_s);
    let document = Document::new(preset, &campaign, runs.complete, &summary).text()?;
    let heading = heading(preset, &campaign, &runs);
    let tables = tables::tables(&summary);
    let mut out = io::stdout().lock();
    if *json {
        out.write_all(document.as_bytes())?;
    } else {
        writeln!(out, "{heading}")?;
        tables::write(&tables, arguments.width.limit(), &mut out)?;
        tables::print_not_exact(&summary, &mut out)?;
    }
    out.flush()?;
    if let Some(directory) = &arguments.out {
        files::write_tables(directory, &runs)?;
        files::write(&directory.join("summary.json"), &document)?;
        report::leave(directory, &heading, &campaign, &tables)?;
    }
    if runs.complete { Ok(()) } else { Err(interrupted(arguments, &runs)) }
}

fn interrupted(arguments: &RunArguments, runs: &Runs) -> Failure {
    let done = runs.scenarios.len() + runs.nominal.len();
    let asked = &arguments.common.runs;
    let all = asked.scenarios + asked.nominal;
    let kept = match &arguments.out {
        Some(directory) => {
            format!("the same command resumes what is in `{}`", directory.display())
        }
        None => "with `--out` it could be resumed".to_owned(),
    };
    Failure::interrupted(format!("interrupted after {done} of {all} runs; {kept}"))
}

fn heading(preset: &str, campaign: &Campaign, runs: &Runs) -> String {
    let ranges = &campaign.ranges;
    let seconds = runs.scenarios.len() as f64 * ranges.length_s
        + runs.nominal.len() as f64 * ranges.nominal_s;
    let hours = seconds / 3600.0;
    let truth = match campaign.mismatch {
        0.0 => "nominal model, no mismatch".to_owned(),
        share => format!("plant within ±{} % of the nominal model", 100.0 * share),
    };
    let controllers: Vec<String> = campaign.controllers.iter().map(ToString::to_string).collect();
    let controllers = controllers.join(", ");
    format!(
        "preset {preset}, seed {}, {truth}, controllers {controllers}: {} scenarios and {} nominal runs, {hours:.2} h of the tower's time",
        campaign.seed,
        runs.scenarios.len(),
        runs.nominal.len(),
    )
}

fn compare_rules(arguments: &CompareArguments) -> Result<(), Failure> {
    let CommonArguments { runs, json, .. } = &arguments.common;
    let campaign = preset::with_runs(&arguments.common)?;
    let stop = interrupt::listen()?;
    let combinations = compare::combinations(runs, &campaign, &stop)?;
    let mut out = io::stdout().lock();
    if *json {
        let comparison = compare::Comparison { combinations: &combinations };
        write!(out, "{}", versioned::text(&comparison)?)?;
    } else {
        let table = tables::comparison(&combinations);
        writeln!(out, "{}", table.text(arguments.width.limit()))?;
    }
    Ok(out.flush()?)
}

fn export(arguments: &ExportArguments) -> Result<(), Failure> {
    let campaign = preset::with_runs(&arguments.common)?;
    let stop = interrupt::listen()?;
    recordings::write(arguments, &campaign, &stop)
}
