//! What was recorded or recovered, for machines and people.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};

use daemon::recorder::RecorderReport;
use recording::Recovered;
use serde::Serialize;

use crate::table::{table, terminal_width};

/// What was recorded.
#[derive(Serialize)]
pub(super) struct Summary<'a> {
    files: &'a [PathBuf],
    recorded: u64,
    fetched: u64,
    lost: u64,
    messages: &'a BTreeMap<String, u64>,
    losses: &'a BTreeMap<String, u64>,
}

impl<'a> Summary<'a> {
    pub(super) fn of(report: &'a RecorderReport) -> Self {
        Self {
            files: &report.files,
            recorded: report.total(),
            fetched: report.fetched,
            lost: report.lost(),
            messages: &report.messages,
            losses: &report.losses,
        }
    }
}

/// The same for people.
pub(super) fn text(report: &RecorderReport) -> String {
    let mut table = table(&["topic", "messages", "lost"]);
    table.align_right([1, 2]);
    let topics = report.messages.keys().chain(report.losses.keys());
    let topics: BTreeSet<&String> = topics.collect();
    for topic in topics {
        let count = |of: &BTreeMap<String, u64>| of.get(topic).copied().unwrap_or(0).to_string();
        table.add_row([topic.clone(), count(&report.messages), count(&report.losses)]);
    }
    let mut text = table.text(terminal_width());
    for file in &report.files {
        let _ = writeln!(text, "{}", file.display());
    }
    let (recorded, fetched, lost) = (report.total(), report.fetched, report.lost());
    let _ = writeln!(text, "{recorded} messages recorded, {fetched} of them fetched; {lost} lost");
    text
}

/// What was recovered.
#[derive(Serialize)]
pub(super) struct Mended<'a> {
    from: &'a Path,
    to: &'a Path,
    messages: u64,
    ending: String,
    problems: &'a [String],
}

impl<'a> Mended<'a> {
    pub(super) fn of(from: &'a Path, to: &'a Path, recovered: &'a Recovered) -> Self {
        let Recovered { messages, problems, ending } = recovered;
        Self { from, to, messages: *messages, ending: ending.to_string(), problems }
    }

    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        let _ = writeln!(text, "{}: {}", self.from.display(), self.ending);
        for problem in self.problems {
            let _ = writeln!(text, "  {problem}");
        }
        let _ = writeln!(text, "{}: {} messages", self.to.display(), self.messages);
        text
    }
}
