//! The summary as tables.

use super::paper_table::{PAPER_TABLE, PaperTable};
use super::record::Closest;
use super::summary::{Isolation, ScenarioSummary};
use crate::report::{Table, interval, percent};
use crate::statistics::{Delays, Interval95};

/// Most scenarios without exact isolation listed one by one.
const SHOWN: usize = 10;

pub(super) fn tables(summary: &ScenarioSummary) -> Vec<Table> {
    vec![paper_table(summary), kinds(summary), delays(summary), alarms(summary)]
}

/// The scenarios without exact isolation.
pub(super) fn not_exact(summary: &ScenarioSummary) -> Option<String> {
    let first = summary.not_exact.first()?;
    let list: Vec<String> = summary.not_exact.iter().take(SHOWN).map(ToString::to_string).collect();
    let more = if summary.not_exact.len() > SHOWN { ", …" } else { "" };
    Some(format!(
        "Not exact: {}{more}. Why: the same command with `--show {first}`",
        list.join(", ")
    ))
}

fn paper_table(summary: &ScenarioSummary) -> Table {
    type Share = fn(&PaperTable<f64>) -> f64;
    let (ours, intervals) = (&summary.samples, &summary.samples_95);
    let shares: [(&str, Share, Interval95); 5] = [
        ("faulty and flagged", |t| t.true_positive, intervals.true_positive),
        ("faulty and not flagged", |t| t.false_negative, intervals.false_negative),
        ("healthy and flagged", |t| t.false_positive, intervals.false_positive),
        ("healthy and not flagged", |t| t.true_negative, intervals.true_negative),
        ("accuracy", |t| t.accuracy, intervals.accuracy),
    ];
    let row = |(name, share, Interval95(low, high)): (&str, Share, Interval95)| {
        vec![
            name.to_owned(),
            format!("{:.4}", share(ours)),
            format!("{low:.4} to {high:.4}"),
            format!("{:.4}", share(&PAPER_TABLE)),
        ]
    };
    Table::new(
        "Share of samples, any flag counting (Table 1 of the paper)",
        &["", "this campaign", "95 %", "the paper"],
        shares.map(row).to_vec(),
    )
    .with_note(format!(
        "\"healthy and not flagged\" includes the warm-up, in which nothing can be flagged, as in the paper; without it \
         the\naccuracy is {:.4}.",
        summary.watched_accuracy
    ))
}

/// A row for each kind of fault, and one for all.
fn rows(
    summary: &ScenarioSummary,
    row: impl Fn(String, &Isolation) -> Vec<String>,
) -> Vec<Vec<String>> {
    let kinds = summary.kinds.iter().map(|(kind, of)| (kind.to_string(), of));
    kinds.chain([("all".to_owned(), &summary.all)]).map(|(name, of)| row(name, of)).collect()
}

fn kinds(summary: &ScenarioSummary) -> Table {
    let row = |name, of: &Isolation| {
        let mut row = vec![name];
        row.extend([of.cases, of.detected, of.exact].map(|count| count.to_string()));
        row.extend([percent(of.exact_share()), interval(of.exact_95)]);
        row.extend([of.wrong, of.missed, of.early].map(|count| count.to_string()));
        row
    };
    let readable = summary.readable_zero_outputs;
    let heading =
        ["fault", "scenarios", "detected", "exact", "", "95 %", "wrong", "missed", "early"];
    Table::new("Which component", &heading, rows(summary, row)).with_note(format!(
        "exact: the faulty component was named, no other, and nothing before the fault. Zero outputs of gages\nwhose \
         healthy reading exceeded ten times its noise: {} of {} found.",
        readable.found, readable.all
    ))
}

fn delays(summary: &ScenarioSummary) -> Table {
    let row = |name, of: &Isolation| {
        let Delays { median, p95, max } = of.delay_ms;
        let verdict = of.verdict_delay_ms;
        let delays = [median, p95, max, verdict.median, verdict.p95];
        let cell = |delay: Option<f64>| delay.map_or_else(|| "–".to_owned(), |ms| ms.to_string());
        [name].into_iter().chain(delays.map(cell)).collect()
    };
    Table::new(
        "Delay of the faulty component [ms]",
        &["fault", "change, median", "95 %", "longest", "verdict, median", "95 %"],
        rows(summary, row),
    )
    .with_note(
        "change: from the fault until the divergence reaches its threshold; verdict: until the fault is committed.",
    )
}

fn alarms(summary: &ScenarioSummary) -> Table {
    let Interval95(_, bound) = summary.nominal.false_alarms_95;
    let (nominal, talk) = (&summary.nominal, &summary.conversation);
    let mut rows = Vec::new();
    let mut row = |what: &str, value: String| rows.push(vec![what.to_owned(), value]);
    if nominal.cases > 0 {
        let runs = format!("{} of {}", nominal.false_alarms, nominal.cases);
        row("nominal runs with a false alarm", runs);
        row("their share with 95 % certainty below", percent(bound));
        let Interval95(low, high) = nominal.per_hour_95;
        if nominal.hours > 0.0 {
            row("hours watched in them, without warm-up", format!("{:.2}", nominal.hours));
            let rate = format!("{:.3} ({low:.3} to {high:.3})", nominal.per_hour);
            row("false alarms per hour (95 %)", rate);
        }
    }
    if let Some(Closest { component, ratio, .. }) = &nominal.closest {
        row("nearest to one", format!("{component}, at {ratio:.2} of its threshold"));
    }
    let asked = format!("{} of {}", summary.with_questions, summary.all.cases);
    row("scenarios in which a peer was asked", asked);
    row("questions", talk.questions.to_string());
    row("channels that changed", talk.changes.to_string());
    row("changes explained by another component", talk.explained.to_string());
    row("of these, by one of another module", talk.explained_by_peer.to_string());
    Table::new("False alarms, and communication between the modules", &["", ""], rows)
}
