//! The journals for people.

use std::fmt::Write;

use comfy_table::CellAlignment;
use wire::FaultTransition;

use super::notes::notes;
use super::reading::Reading;
use crate::paint::{Colour, Paint};
use crate::table::table;
use crate::telling::{NOTHING, or_nothing, painted, reason, state_colour, utc};

const HEADING: [&str; 7] = ["time", "module", "sequence", "component", "state", "step", "why"];

/// The text: the transitions, and what the journals do not tell.
pub(super) fn report(reading: &Reading, transitions: &[&FaultTransition], paint: Paint) -> String {
    let mut text = String::new();
    if reading.is_of_anybody() && transitions.is_empty() {
        text.push_str("no transitions\n");
    } else if !transitions.is_empty() {
        let mut table = table(&HEADING);
        for transition in transitions {
            table.add_row(row(transition));
        }
        for column in [2, 5] {
            if let Some(column) = table.column_mut(column) {
                column.set_cell_alignment(CellAlignment::Right);
            }
        }
        let colours: Vec<_> =
            transitions.iter().map(|transition| Some(state_colour(transition.state))).collect();
        // Writing to a string does not fail.
        let _ = writeln!(text, "{}", painted(&table, &colours, paint));
    }
    for note in notes(reading) {
        let _ = writeln!(text, "{}", paint.in_colour(Colour::Yellow, &format!("note: {note}")));
    }
    text
}

fn row(transition: &FaultTransition) -> [String; 7] {
    let why = reason(transition);
    [
        utc(transition.time_unix_ns),
        transition.module.to_string(),
        transition.sequence.to_string(),
        transition.component.component.to_string(),
        transition.state.to_string(),
        or_nothing(transition.decided_step),
        if why.is_empty() { NOTHING.to_owned() } else { why },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::history::testing::{acknowledged, history, transition};

    #[test]
    fn the_table_is_this() {
        let histories = vec![history("m1", vec![transition("m1", 1, 0), acknowledged("m1", 2)])];
        let reading = Reading { since: 1, histories, silent: Vec::new() };
        let transitions: Vec<&FaultTransition> = reading.histories[0].transitions.iter().collect();
        let told = report(&reading, &transitions, Paint::for_terminal(false));
        let told: Vec<&str> = told.lines().map(str::trim_end).collect();
        let expected = "
  time                       module   sequence   component   state          step   why
──────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────
  1970-01-01T00:00:00.000Z   m1              1   sensor/g1   latched           7   -
  1970-01-01T00:00:01.000Z   m1              2   sensor/g1   acknowledged      7   acknowledged by ada@desk: looks loose";
        let told = format!("\n{}", told.join("\n"));
        assert_eq!(told, expected, "{told}");
    }

    #[test]
    fn journals_without_transitions_are_told_as_such() {
        let reading =
            Reading { since: 1, histories: vec![history("m1", vec![])], silent: Vec::new() };
        assert_eq!(report(&reading, &[], Paint::for_terminal(false)), "no transitions\n");
    }
}
