//! What came of a campaign, as tables for people.

use std::io::{self, Write};

use diagnosis::Rule;
use diagnosis::residual::ActuatorResidual;
use names::fault::FaultKind;
use study::summary::{Delays, Interval95, KindSummary, PAPER_TABLE, PaperTable, Summary};
use study::{Closest, PowerCurve};

use super::compare::Combination;
use crate::table::{TextTable, table};

/// Not-exact scenarios that are listed one by one.
const SHOWN: usize = 10;

/// A table with its title, for the terminal and for the report.
pub(super) struct Titled {
    pub(super) title: &'static str,
    pub(super) note: String,
    pub(super) heading: Vec<&'static str>,
    pub(super) rows: Vec<Vec<String>>,
}

/// All tables of a summary.
pub(super) fn tables(summary: &Summary) -> Vec<Titled> {
    vec![paper_table(summary), kinds(summary), delays(summary), alarms(summary)]
}

/// The table of a power study.
pub(super) fn power(curves: &[PowerCurve]) -> Vec<Titled> {
    vec![minimum_isolable(curves)]
}

/// Writes tables no wider than `width`.
pub(super) fn write(tables: &[Titled], width: Option<u16>, out: &mut impl Write) -> io::Result<()> {
    for titled in tables {
        writeln!(out, "\n{}", titled.title)?;
        writeln!(out, "{}", titled.in_columns().text(width))?;
        if !titled.note.is_empty() {
            writeln!(out, "{}", titled.note)?;
        }
    }
    Ok(())
}

/// Names the scenarios that deserve a look.
pub(super) fn print_not_exact(summary: &Summary, out: &mut impl Write) -> io::Result<()> {
    let Some(first) = summary.not_exact.first() else { return Ok(()) };
    let list: Vec<String> = summary.not_exact.iter().take(SHOWN).map(ToString::to_string).collect();
    let more = if summary.not_exact.len() > SHOWN { ", …" } else { "" };
    writeln!(out, "\nNot exact: {}{more}. Why: `trusswatch study explain {first}`", list.join(", "))
}

impl Titled {
    fn in_columns(&self) -> TextTable {
        let mut table = table(&self.heading);
        for row in &self.rows {
            table.add_row(row);
        }
        table.align_right(1..self.heading.len());
        table
    }
}

fn paper_table(summary: &Summary) -> Titled {
    type Share = fn(&PaperTable) -> f64;
    let (ours, intervals) = (&summary.paper_table, &summary.paper_table_95);
    let shares: [(&str, Share, Interval95); 5] = [
        ("faulty and flagged", |t| t.true_positive, intervals.true_positive),
        ("faulty and not flagged", |t| t.false_negative, intervals.false_negative),
        ("healthy and flagged", |t| t.false_positive, intervals.false_positive),
        ("healthy and not flagged", |t| t.true_negative, intervals.true_negative),
        ("accuracy", PaperTable::accuracy, intervals.accuracy),
    ];
    let row = |(name, share, Interval95(low, high)): (&str, Share, Interval95)| {
        vec![
            name.to_owned(),
            format!("{:.4}", share(ours)),
            format!("{low:.4} to {high:.4}"),
            format!("{:.4}", share(&PAPER_TABLE)),
        ]
    };
    Titled {
        title: "Share of samples, any flag counting (Table 1 of the paper)",
        note: String::new(),
        heading: vec!["", "this campaign", "95 %", "the paper"],
        rows: shares.map(row).to_vec(),
    }
}

fn kinds(summary: &Summary) -> Titled {
    let mut rows: Vec<Vec<String>> =
        summary.kinds.iter().map(|(kind, counts)| kind_row(*kind, counts)).collect();
    let sum = |of: fn(&KindSummary) -> u64| summary.kinds.values().map(of).sum::<u64>().to_string();
    rows.push(vec![
        "all".to_owned(),
        summary.scenarios.to_string(),
        sum(|kind| kind.detected),
        sum(|kind| kind.exact),
        percent(summary.exact_isolation.overall),
        interval(summary.exact_isolation.overall_95),
        sum(|kind| kind.wrong),
        sum(|kind| kind.missed),
        sum(|kind| kind.early),
    ]);
    let readable = summary.readable_zero_outputs;
    Titled {
        title: "Which component",
        note: format!(
            "exact: the faulty component was named, no other, and nothing before the fault. Zero \
             outputs of gages\nwhose healthy reading exceeded ten times its noise: {} of {} found.",
            readable.found, readable.all
        ),
        heading: vec![
            "fault",
            "scenarios",
            "detected",
            "exact",
            "",
            "95 %",
            "wrong",
            "missed",
            "early",
        ],
        rows,
    }
}

fn kind_row(kind: FaultKind, counts: &KindSummary) -> Vec<String> {
    vec![
        kind.to_string(),
        counts.scenarios.to_string(),
        counts.detected.to_string(),
        counts.exact.to_string(),
        percent(counts.exact as f64 / counts.scenarios as f64),
        interval(counts.exact_95),
        counts.wrong.to_string(),
        counts.missed.to_string(),
        counts.early.to_string(),
    ]
}

fn delays(summary: &Summary) -> Titled {
    let row = |(kind, delays): (&FaultKind, &Delays)| {
        let verdict = summary.verdict_delay_ms.get(kind).copied().unwrap_or_default();
        vec![
            kind.to_string(),
            milliseconds(delays.median),
            milliseconds(delays.p95),
            milliseconds(delays.max),
            milliseconds(verdict.median),
            milliseconds(verdict.p95),
        ]
    };
    let mut rows: Vec<Vec<String>> = summary.delay_ms.iter().map(row).collect();
    let Delays { median, p95, max } = summary.delay_ms_overall;
    let [median, p95, max] = [median, p95, max].map(milliseconds);
    rows.push(vec!["all".to_owned(), median, p95, max, String::new(), String::new()]);
    Titled {
        title: "Delay of the faulty component [ms]",
        note: "change: from the fault until the divergence reaches its threshold; verdict: until \
               the fault is committed."
            .to_owned(),
        heading: vec!["fault", "change, median", "95 %", "longest", "verdict, median", "95 %"],
        rows,
    }
}

fn alarms(summary: &Summary) -> Titled {
    let Interval95(_, bound) = summary.false_alarm_runs_95;
    let talk = &summary.conversation;
    let mut rows = Vec::new();
    let mut row = |what: &str, value: String| rows.push(vec![what.to_owned(), value]);
    if summary.nominal_runs > 0 {
        let runs = format!("{} of {}", summary.false_alarm_runs, summary.nominal_runs);
        row("nominal runs with a false alarm", runs);
        row("their share with 95 % certainty below", percent(bound));
    }
    if let Some(closest) = &summary.closest {
        let Closest { component, ratio, .. } = closest;
        row("nearest to one", format!("{component}, at {ratio:.2} of its threshold"));
    }
    let asked = format!("{} of {}", summary.scenarios_with_questions, summary.scenarios);
    row("scenarios in which a peer was asked", asked);
    row("questions", talk.questions.to_string());
    row("channels that changed", talk.changes.to_string());
    row("changes explained by another component", talk.explained.to_string());
    row("of these, by one of another module", talk.explained_by_peer.to_string());
    Titled {
        title: "False alarms, and communication between the modules",
        note: String::new(),
        heading: vec!["", ""],
        rows,
    }
}

fn minimum_isolable(curves: &[PowerCurve]) -> Titled {
    let row = |curve: &PowerCurve| {
        let size = curve.smallest_95.map_or_else(|| "none tried".to_owned(), |s| format!("{s:.1}"));
        vec![curve.title.clone(), size, curve.unit.clone()]
    };
    Titled {
        title: "Minimum isolable fault: named in 95 of 100 runs within 1 s",
        note: String::new(),
        heading: vec!["fault", "size", "times"],
        rows: curves.iter().map(row).collect(),
    }
}

pub(super) fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

pub(super) fn interval(Interval95(low, high): Interval95) -> String {
    format!("{:.1} to {:.1} %", 100.0 * low, 100.0 * high)
}

fn milliseconds(delay: Option<f64>) -> String {
    delay.map_or_else(|| "–".to_owned(), |delay| format!("{delay}"))
}

/// The four combinations side by side.
pub(super) fn comparison(combinations: &[Combination]) -> TextTable {
    let heading = [
        "rule",
        "actuator residual",
        "exactly isolated",
        "95 %",
        "wrong component",
        "missed",
        "early",
        "accuracy",
        "false alarms",
    ];
    let mut text = table(&heading);
    for Combination { rule, actuator_residual, summary } in combinations {
        let rule = match rule {
            Rule::Paper => "only actuators explain (paper)",
            Rule::FirstChange => "first change names the fault",
        };
        let residual = match actuator_residual {
            ActuatorResidual::Demand => "demand (paper)",
            ActuatorResidual::Tracking => "tracking",
        };
        text.add_row(vec![
            rule.to_owned(),
            residual.to_owned(),
            percent(summary.exact_isolation.overall),
            interval(summary.exact_isolation.overall_95),
            summary.wrong_component_runs.to_string(),
            summary.missed_runs.to_string(),
            summary.early_runs.to_string(),
            format!("{:.4}", summary.accuracy),
            format!("{} of {}", summary.false_alarm_runs, summary.nominal_runs),
        ]);
    }
    text
}
