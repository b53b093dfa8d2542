//! The rows with what was expected and seen.

use super::SETTLING;
use super::row::Outcome;
use crate::grid;

/// Problems of a row that are shown in the table; all of them follow below it.
const SHOWN: usize = 2;

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
        let expected = format!("expected within {SETTLING} steps");
        let mut grid = grid::headed(["fault", &expected, "seen", ""]);
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
        words.push(format!("settled in {after} steps"));
    }
    words.extend(outcome.problems.iter().take(SHOWN).cloned());
    if outcome.problems.len() > SHOWN {
        words.push(format!("{} more", outcome.problems.len() - SHOWN));
    }
    words.extend(outcome.seen.iter().cloned());
    words.join("; ")
}
