//! Runs, resumes, explains or merges any campaign, and prints and keeps what comes of it.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use serde::Serialize;
use serde_json::Value;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use study::journal::{self, CampaignHeader, CampaignJournal};
use study::report::{StudyReport, Table};
use study::{Begin, Campaign, Done, Engine, EngineWork, LineKind, PlantRow, StudyError, explain};

use super::arguments::{CampaignRequest, EngineArguments, MergeArguments, OutputArguments};
use super::files;
use crate::failure::Failure;
use crate::output;
use crate::paint::{Colour, Paint};
use crate::progress::WorkProgress;
use crate::table::table;

/// What was asked for and what came of it.
#[derive(Serialize)]
struct CampaignDocument<'a, S> {
    campaign: &'a Value,
    /// Were all cases run?
    complete: bool,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    plants: Vec<&'a PlantRow>,
    #[serde(flatten)]
    summary: &'a S,
}

/// Runs the campaign that is asked for.
pub(super) fn run(request: &CampaignRequest) -> Result<(), Failure> {
    let request = request.clone().resolved();
    let value = serde_json::to_value(&request)?;
    match &request {
        CampaignRequest::Run(of) => run_campaign(value, &of.of.campaign()?, &of.engine),
        CampaignRequest::Conditions(of) => run_campaign(value, &of.campaign()?, &of.engine),
        CampaignRequest::Limits(of) => run_campaign(value, &of.campaign()?, &of.engine),
        CampaignRequest::Identify(of) => run_campaign(value, &of.campaign()?, &of.engine),
        CampaignRequest::Tolerance(of) => run_campaign(value, &of.campaign()?, &of.engine),
        CampaignRequest::Rivals(of) => run_campaign(value, &of.campaign()?, &of.engine),
    }
}

/// Puts the shards of a campaign together.
pub(super) fn merge(arguments: &MergeArguments) -> Result<(), Failure> {
    let first = arguments.directories.first().map(|directory| CampaignHeader::of(directory));
    let value = first.transpose()?.map(|header| header.campaign).unwrap_or_default();
    let request: CampaignRequest = serde_json::from_value(value.clone())
        .map_err(|error| Failure::input(format!("a journal holds an unknown request: {error}")))?;
    match &request {
        CampaignRequest::Run(of) => merge_campaign(value, &of.of.campaign()?, arguments),
        CampaignRequest::Conditions(of) => merge_campaign(value, &of.campaign()?, arguments),
        CampaignRequest::Limits(of) => merge_campaign(value, &of.campaign()?, arguments),
        CampaignRequest::Identify(of) => merge_campaign(value, &of.campaign()?, arguments),
        CampaignRequest::Tolerance(of) => merge_campaign(value, &of.campaign()?, arguments),
        CampaignRequest::Rivals(of) => merge_campaign(value, &of.campaign()?, arguments),
    }
}

/// Exit code of a program that a second signal ended.
const ENDED_BY_SIGNAL: i32 = 130;

/// A flag that the first SIGINT or SIGTERM sets: running cases finish. The second one ends the program at once.
pub(crate) fn stop_on_signal() -> Result<Arc<AtomicBool>, Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // In this order: the first signal must find the flag unset here and set it below.
        flag::register_conditional_shutdown(signal, ENDED_BY_SIGNAL, Arc::clone(&stop))
            .and_then(|_| flag::register(signal, Arc::clone(&stop)))
            .map_err(|error| Failure::runtime(format!("cannot listen for signals: {error}")))?;
    }
    Ok(stop)
}

/// An engine that reports its progress on standard error.
pub(super) fn engine(jobs: usize, stop: &AtomicBool) -> Engine<'_> {
    const BEGIN: Begin = &|work, all| {
        let progress = match work {
            EngineWork::Commissioning => WorkProgress::new("commissioning", "snippets", all),
            EngineWork::Cases => WorkProgress::new("cases", "runs", all),
        };
        Box::new(move || progress.advance())
    };
    Engine { jobs, stop, begin: BEGIN }
}

fn run_campaign<C: Campaign>(
    request: Value,
    campaign: &C,
    asked: &EngineArguments,
) -> Result<(), Failure> {
    let stop = stop_on_signal()?;
    let engine = engine(asked.jobs.count(), &stop);
    if let Some(case) = asked.show {
        return show(campaign, case, &engine);
    }
    let cases = asked.shard.map_or(0..campaign.cases(), |shard| shard.cases(campaign.cases()));
    let header = CampaignHeader::new(request, campaign, asked.shard.map(|shard| shard.to_string()));
    let (mut journal, mut done) = match &asked.output.out {
        Some(directory) => {
            let (journal, done) =
                CampaignJournal::open(directory, &header).map_err(|error| match error {
                    StudyError::Journal { .. } => {
                        Failure::input(format!("{error}; give another directory with `--out`"))
                    }
                    error => error.into(),
                })?;
            (Some(journal), done)
        }
        None => (None, Done::default()),
    };
    engine.run(campaign, cases.clone(), &mut done, journal.as_mut())?;
    drop(journal);
    let (count, all) = (done.rows.len() as u64, cases.end - cases.start);
    if asked.shard.is_none() {
        report(&header, campaign, &done, &asked.output)?;
    }
    match (&asked.output.out, asked.shard) {
        (Some(directory), _) if count < all => Err(Failure::interrupted(format!(
            "interrupted after {count} of {all} cases; the same command resumes what is in `{}`",
            directory.display()
        ))),
        (None, _) if count < all => Err(Failure::interrupted(format!(
            "interrupted after {count} of {all} cases; with `--out` it could be resumed"
        ))),
        (_, None) => defects(campaign, &done),
        (_, Some(shard)) => output::print(&format!(
            "shard {shard}: {all} cases; `trusswatch study merge` puts shards together\n"
        )),
    }
}

fn merge_campaign<C: Campaign>(
    request: Value,
    campaign: &C,
    arguments: &MergeArguments,
) -> Result<(), Failure> {
    let header = CampaignHeader::new(request, campaign, None);
    let done = journal::read_all(&arguments.directories, &header)?;
    let missing = (0..campaign.cases()).filter(|case| !done.rows.contains_key(case));
    if let Some(first) = missing.clone().next() {
        return Err(Failure::input(format!(
            "{} of {} cases are missing, the first of them {first}: run every shard to its end",
            missing.count(),
            campaign.cases(),
        )));
    }
    if let Some(directory) = &arguments.output.out {
        files::make(directory)?;
    }
    report(&header, campaign, &done, &arguments.output)?;
    defects(campaign, &done)
}

/// Prints what came of the cases, and keeps it.
fn report<C: Campaign>(
    header: &CampaignHeader,
    campaign: &C,
    done: &Done<C::Row>,
    output: &OutputArguments,
) -> Result<(), Failure> {
    let complete = done.rows.len() as u64 == campaign.cases();
    let summary = campaign.summarize(&done.rows);
    let plants = done.plants.values().collect();
    let document =
        CampaignDocument { campaign: &header.campaign, complete, plants, summary: &summary };
    let document = output::text(&document)?;
    let (tables, notes) = campaign.tables(&done.rows, &summary);
    let heading = in_words(&header.campaign);
    let mut out = output::stdout();
    if output.json {
        out.write_all(document.as_bytes())?;
    } else {
        writeln!(out, "{heading}")?;
        write_tables(&tables, output.width.limit(), &mut out)?;
        if !notes.is_empty() {
            writeln!(out, "\n{}", notes.join("\n"))?;
        }
    }
    out.flush()?;
    let Some(directory) = &output.out else { return Ok(()) };
    if complete {
        // In the order of cases, in which they did not come.
        files::write(&directory.join(journal::FILE), journal::text(header, done)?)?;
    }
    files::write(&directory.join("summary.json"), &document)?;
    files::write_cases(directory, &done.rows)?;
    let figures = campaign.figures(&summary)?;
    for figure in &figures {
        files::write(&directory.join(format!("{}.svg", figure.name)), &figure.svg)?;
    }
    let paragraphs = [heading].into_iter().chain(notes).collect();
    let report =
        StudyReport { title: "trusswatch: a study".to_owned(), paragraphs, tables, figures };
    files::write(&directory.join("report.html"), study::report::html(&report))
}

/// `run: controllers shipped, mismatch 0, …`
fn in_words(request: &Value) -> String {
    let plain = |value: &Value| match value {
        Value::String(text) => text.clone(),
        Value::Array(all) => {
            all.iter().map(|one| one.as_str().unwrap_or_default()).collect::<Vec<_>>().join(", ")
        }
        other => other.to_string(),
    };
    let fields = request.as_object().into_iter().flatten();
    let is_said = |value: &Value| !matches!(value, Value::Null | Value::Bool(false));
    let fields = fields.filter(|(key, value)| *key != "name" && is_said(value));
    let fields = fields.map(|(key, value)| format!("{} {}", key.replace('_', " "), plain(value)));
    let fields: Vec<String> = fields.filter(|field| !field.ends_with(' ')).collect();
    format!("{}: {}", request["name"].as_str().unwrap_or_default(), fields.join("; "))
}

/// Writes tables no wider than `width`.
fn write_tables(tables: &[Table], width: Option<u16>, out: &mut impl Write) -> io::Result<()> {
    for Table { title, note, heading, rows } in tables {
        let heading: Vec<&str> = heading.iter().map(String::as_str).collect();
        let mut text = table(&heading);
        rows.iter().for_each(|row| text.add_row(row));
        text.align_right(1..heading.len());
        writeln!(out, "\n{title}\n{}", text.text(width))?;
        if !note.is_empty() {
            writeln!(out, "{note}")?;
        }
    }
    Ok(())
}

/// Fails if a healthy component was named.
fn defects<C: Campaign>(campaign: &C, done: &Done<C::Row>) -> Result<(), Failure> {
    let all = done.rows.iter().map(|(case, row)| (case, campaign.defects(row)));
    let mut all = all.filter(|(_, names)| !names.is_empty());
    let Some((case, names)) = all.next() else { return Ok(()) };
    Err(Failure::runtime(format!(
        "a healthy component was named in {} of the cases, {} in case {case}; see what happens there: the campaign's \
         command with `--show {case}`",
        1 + all.count(),
        names.join(", "),
    )))
}

/// Runs one case and explains it.
fn show<C: Campaign>(campaign: &C, case: u64, engine: &Engine) -> Result<(), Failure> {
    if case >= campaign.cases() {
        let all = campaign.cases();
        return Err(Failure::usage(format!("`--show` is {case}; the campaign has {all} cases")));
    }
    let explanation = explain(campaign, case, engine)?;
    let paint = Paint::of_stdout();
    let mut out = output::stdout();
    for line in &explanation.lines {
        match colour(line.kind) {
            Some(colour) => writeln!(out, "{}", paint.in_colour(colour, &line.to_string()))?,
            None => writeln!(out, "{line}")?,
        }
    }
    out.flush()?;
    let rows = [(case, explanation.row)].into();
    defects(campaign, &Done { rows, ..Done::default() })
}

fn colour(kind: LineKind) -> Option<Colour> {
    match kind {
        LineKind::Fault => Some(Colour::Red),
        LineKind::Injected
        | LineKind::Repaired
        | LineKind::Gap
        | LineKind::Unconfirmed
        | LineKind::Condition => Some(Colour::Yellow),
        LineKind::Explained => Some(Colour::Green),
        LineKind::Change | LineKind::Identified => Some(Colour::Cyan),
        LineKind::Watching | LineKind::Asked | LineKind::Answered | LineKind::More => {
            Some(Colour::Dim)
        }
        LineKind::Setting | LineKind::Outcome | LineKind::Because => None,
    }
}

impl From<StudyError> for Failure {
    fn from(error: StudyError) -> Self {
        match error {
            StudyError::File { .. } | StudyError::Write(_) => Failure::runtime(error.to_string()),
            StudyError::Interrupted => Failure::interrupted("interrupted"),
            _ => Failure::input(error.to_string()),
        }
    }
}
