//! What was tried, what should come of it, and what did.

use crate::grid;

/// A row: one attempt.
#[derive(Debug)]
struct Row {
    what: &'static str,
    expected: &'static str,
    seen: String,
    ok: bool,
}

/// Everything that was tried.
#[derive(Debug, Default)]
pub struct Table {
    rows: Vec<Row>,
}

impl Table {
    /// Something that must work.
    pub fn allowed(&mut self, what: &'static str, works: bool) {
        let seen = if works { "works" } else { "does not work" }.to_owned();
        self.rows.push(Row { what, expected: "works", seen, ok: works });
    }

    /// Something that must have no effect and leave a trace in a log.
    pub fn forbidden(&mut self, what: &'static str, has_effect: bool, trace: Option<String>) {
        let effect = if has_effect { "an effect" } else { "no effect" };
        let logged = trace.as_deref().map_or("no trace", message);
        let seen = format!("{effect}; {logged}");
        let ok = !has_effect && trace.is_some();
        self.rows.push(Row { what, expected: "no effect, logged", seen, ok });
    }

    /// Something that must have no effect, and of which nobody can leave a trace.
    pub fn harmless(&mut self, what: &'static str, has_effect: bool) {
        let seen = if has_effect { "an effect" } else { "no effect" }.to_owned();
        self.rows.push(Row { what, expected: "no effect", seen, ok: !has_effect });
    }

    /// Rows that are not as expected.
    #[must_use]
    pub fn failed(&self) -> Vec<&'static str> {
        self.rows.iter().filter(|row| !row.ok).map(|row| row.what).collect()
    }

    /// The table.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut grid = grid::headed(["attempt", "expected", "seen", ""]);
        for row in &self.rows {
            let verdict = if row.ok { "ok" } else { "FAILED" };
            grid.add_row([row.what, row.expected, &row.seen, verdict]);
        }
        grid.to_string()
    }
}

/// A line of a log without its time, level and place.
fn message(line: &str) -> &str {
    line.split_once("refusals: ").map_or(line, |(_, message)| message)
}
