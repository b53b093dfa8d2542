//! How entries are printed: coloured lines for people, or one JSON object a line for machines.

use std::collections::BTreeSet;
use std::io::{self, IsTerminal, Write};

use super::entry::{DiagnosedFault, Entry, Process, Summary, Verdict};
use super::finding;
use crate::paint::state_colour;
use crate::paint::{Colour, Paint};
use crate::table::{table, terminal_width};
use crate::versioned;
use names::ModuleName;
use serde::Serialize;
use wording::{brief, candidate, printable};

/// Prints entries on standard output.
pub(super) struct Printer {
    json: bool,
    paint: Paint,
    /// The width that tables may have.
    width: Option<u16>,
    step_s: f64,
    /// Changes and explanations of the present story that people have read already.
    read: BTreeSet<String>,
}

#[derive(Serialize)]
struct Timed<'a> {
    #[serde(flatten)]
    entry: &'a Entry,
    #[serde(skip_serializing_if = "Option::is_none")]
    time_s: Option<f64>,
}

impl Printer {
    pub(super) fn new(json: bool, step_s: f64) -> Printer {
        Printer {
            json,
            paint: Paint::for_terminal(io::stdout().is_terminal()),
            width: terminal_width(),
            step_s,
            read: BTreeSet::new(),
        }
    }

    /// Prints an entry, at once.
    pub(super) fn print(&mut self, entry: &Entry) -> io::Result<()> {
        let mut out = io::stdout().lock();
        let time_s = entry.step().map(|step| step.0 as f64 * self.step_s);
        if self.json {
            write!(out, "{}", versioned::line(&Timed { entry, time_s })?)?;
        } else if matches!(entry, Entry::Started { .. } | Entry::Summary(_)) {
            writeln!(out, "{}", self.text(entry))?;
        } else if self.is_new(entry) {
            let time = time_s.map_or_else(String::new, |time_s| format!("{time_s:.3} s"));
            for line in self.text(entry).lines() {
                let time = if line.is_empty() { "" } else { &time };
                writeln!(out, "{}", format!("{time:>10}  {line}").trim_end())?;
            }
        }
        out.flush()
    }

    /// False for a change or an explanation that was printed in this story already: as a disturbance
    /// passes, channels rise above their thresholds again and again.
    fn is_new(&mut self, entry: &Entry) -> bool {
        match entry {
            Entry::Change { component, .. } => self.read.insert(component.to_string()),
            Entry::Verdict(Verdict {
                component,
                verdict: wire::Verdict::Explained { by, .. },
                ..
            }) => self.read.insert(format!("{component} {by}")),
            Entry::Injected { .. } => {
                self.read.clear();
                true
            }
            _ => true,
        }
    }

    fn text(&self, entry: &Entry) -> String {
        let paint = &self.paint;
        match entry {
            Entry::Started { structure, processes, endpoint } => {
                started(structure, processes, endpoint)
            }
            Entry::Ready { process } => format!("ready      {process}"),
            Entry::WarmingUp { step, of_step } => {
                format!("warming up step {step} of {of_step}")
            }
            Entry::InService { module, .. } => {
                format!("in service {module}: every channel is watched")
            }
            Entry::Compared { agree, of, .. } => compared(*agree, *of),
            Entry::Injected { component, fault, story, .. } => {
                let what = format!("{component}: {fault}");
                format!("\n{}  {}\n{story}", paint.bold("INJECT   "), paint.bold(&what))
            }
            Entry::Repaired { component, .. } => format!("repair     {component}"),
            Entry::Change { component, ratio, .. } => paint.in_colour(
                Colour::Dim,
                &format!("change     {component}, divergence at {ratio:.1} times its threshold"),
            ),
            Entry::Unanswered { module, questions, .. } => {
                paint.in_colour(Colour::Cyan, &unanswered(module, *questions))
            }
            Entry::Verdict(found) => {
                paint.in_colour(state_colour(found.verdict.state()), &finding::of(found))
            }
            Entry::SetAside { component, what, .. } => format!("aside      {component}, {what}"),
            Entry::Identified { component, found, .. } => {
                format!("identified {component}, {}", candidate(found))
            }
            Entry::Trouble { text } => {
                paint.in_colour(Colour::Yellow, &format!("trouble    {}", printable(text)))
            }
            Entry::Summary(summary) => self.summary(summary),
        }
    }

    fn summary(&self, summary: &Summary) -> String {
        let mut table = table(&[
            "fault",
            "component",
            "injected",
            "diagnosed",
            "identified",
            "delay",
            "verdict after",
        ]);
        for injected in &summary.injected {
            let named = summary.diagnosed.iter().find(|d| d.component == injected.component);
            let ms = |ms: Option<f64>| ms.map_or_else(|| "-".into(), |ms| format!("{ms:.0} ms"));
            table.add_row([
                injected.fault.kind().to_string(),
                injected.component.to_string(),
                format!("step {}", injected.step),
                named.map_or_else(|| "NOT NAMED".into(), |named| named.component.to_string()),
                identified(named),
                ms(named.and_then(|named| named.delay_ms)),
                ms(named.and_then(|named| named.verdict_delay_ms)),
            ]);
        }
        for named in &summary.diagnosed {
            if !summary.injected.iter().any(|injected| injected.component == named.component) {
                let at = named.detection_step.map_or_else(|| "-".into(), |s| format!("step {s}"));
                let dash = || "-".to_owned();
                let kind = identified(Some(named));
                table.add_row([
                    dash(),
                    dash(),
                    dash(),
                    named.component.to_string(),
                    kind,
                    at,
                    dash(),
                ]);
            }
        }
        table.align_right(5..7);
        table.stack(&[&[0, 4], &[1, 3], &[2], &[5, 6]]);
        let verdict = if summary.exact {
            self.paint
                .in_colour(Colour::Green, "exact: every injected fault was named, and nothing else")
        } else {
            self.paint.in_colour(Colour::Red, "not exact: injected and diagnosed faults differ")
        };
        format!("\n{}\n\n{verdict}", table.text(self.width))
    }
}

/// The kind that was found, with its size but without the interval.
fn identified(named: Option<&DiagnosedFault>) -> String {
    match named.map(|named| named.identified.as_ref()) {
        None => "-".to_owned(),
        Some(None) => "not decided".to_owned(),
        Some(Some(found)) => brief(found),
    }
}

fn started(structure: &str, processes: &[Process], endpoint: &str) -> String {
    let processes: Vec<_> =
        processes.iter().map(|process| format!("{} ({})", process.name, process.pid)).collect();
    format!("{structure}: {}\nwatch it:\n{}\n", processes.join(", "), watch_line(endpoint))
}

/// The line that shows the faults in another terminal.
fn watch_line(endpoint: &str) -> String {
    format!(
        "  zenoh --mode client --connect {endpoint} --cfg scouting/multicast/enabled:false \
         subscribe -k 'trusswatch/*/*/fault/**' --decoder json --line '{{key}} {{value}}'"
    )
}

fn compared(agree: u64, of: u64) -> String {
    format!("compared   {agree} of {of} components agree with what the healthy modules measured")
}

fn unanswered(module: &ModuleName, questions: u64) -> String {
    let what = match questions {
        1 => "a question".to_owned(),
        count => format!("{count} questions"),
    };
    format!("unanswered {what} of {module} to its peers; it asks again")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn questions_are_counted_in_words() {
        let module: ModuleName = "m1".parse().unwrap();
        let [one, two] = [1, 2].map(|questions| unanswered(&module, questions));
        assert_eq!(one, "unanswered a question of m1 to its peers; it asks again");
        assert_eq!(two, "unanswered 2 questions of m1 to its peers; it asks again");
    }
}
