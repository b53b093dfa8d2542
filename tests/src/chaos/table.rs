//! The rows with what was expected and seen.

use comfy_table::{LineStyle, Table as Grid, presets};

use super::SETTLING;
use super::row::Outcome;

/// Problems of a row that are told in the table; all of them follow below it.
const TOLD: usize = 2;

const RULE: LineStyle = LineStyle::new('─', '─', '─', '─');

/// Rows that were run.
#[derive(Default)]
pub struct Table {
    rows: Vec<(String, Outcome)>,
}

impl Table {
    /// Adds a row.
    pub fn add(&mut self, fault: String, outcome: Outcome) {
        self.rows.push((fault, outcome));
    }

    /// Faults whose rows failed.
    #[must_use]
    pub fn failed(&self) -> Vec<&str> {
        let failed = self.rows.iter().filter(|(_, outcome)| !outcome.problems.is_empty());
        failed.map(|(fault, _)| fault.as_str()).collect()
    }

    /// The table, and below it everything about the rows that failed.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut grid = Grid::new();
        grid.load_style(presets::NOTHING.header_separator(RULE));
        grid.set_header(["fault", &format!("expected within {SETTLING:?}"), "seen", ""]);
        for (fault, outcome) in &self.rows {
            let verdict = if outcome.problems.is_empty() { "ok" } else { "FAILED" };
            grid.add_row([fault.as_str(), &outcome.expected, &seen(outcome), verdict]);
        }
        let failed = self.rows.iter().filter(|(_, outcome)| !outcome.problems.is_empty());
        let details = failed
            .map(|(fault, outcome)| format!("\n{fault}:\n  {}\n", outcome.problems.join("\n  ")));
        format!("{grid}\n{}", details.collect::<String>())
    }
}

fn seen(outcome: &Outcome) -> String {
    let mut words = Vec::new();
    if let Some(after) = outcome.settled {
        words.push(format!("settled in {:.2} s", after.as_secs_f64()));
    }
    words.extend(outcome.problems.iter().take(TOLD).cloned());
    if outcome.problems.len() > TOLD {
        words.push(format!("{} more", outcome.problems.len() - TOLD));
    }
    words.extend(outcome.seen.iter().cloned());
    words.join("; ")
}
