//! The journals for people.

use std::fmt::Write;

use wire::{FaultTransition, Identification};

use super::merge::Entry;
use super::notes::notes;
use super::reading::Reading;
use crate::paint::state_colour;
use crate::paint::{Colour, Paint};
use crate::table::{TextTable, table};
use wording::{NOTHING, identified, or_nothing, reason, utc};

const HEADING: [&str; 7] = ["time", "module", "sequence", "component", "state", "step", "why"];

/// The text: the transitions, what the faults are, and what is missing from the journals.
pub(super) fn report(
    reading: &Reading,
    entries: &[Entry<'_>],
    width: Option<u16>,
    paint: Paint,
) -> String {
    let mut text = String::new();
    if reading.is_of_anybody() && entries.is_empty() {
        text.push_str("no transitions\n");
    } else if !entries.is_empty() {
        let colours: Vec<_> = entries.iter().map(colour).collect();
        // Writing to a string does not fail.
        let _ = writeln!(text, "{}", in_columns(entries).painted(width, &colours, paint));
    }
    for note in notes(reading) {
        let _ = writeln!(text, "{}", paint.in_colour(Colour::Yellow, &format!("note: {note}")));
    }
    text
}

fn in_columns(entries: &[Entry<'_>]) -> TextTable {
    let mut table = table(&HEADING);
    for entry in entries {
        table.add_row(match entry {
            Entry::Transition(transition) => row(transition),
            Entry::Identification(found) => row_of_identification(found),
        });
    }
    table.align_right([2, 5]);
    table.break_times(0);
    table.stack(&[&[0], &[1, 2], &[3], &[4, 5], &[6]]);
    table
}

fn row(transition: &FaultTransition) -> [String; 7] {
    let why = reason(transition);
    [
        utc(transition.time_unix_ns),
        transition.module.to_string(),
        transition.sequence.to_string(),
        transition.component.component.to_string(),
        transition.state().to_string(),
        or_nothing(transition.decided_step),
        if why.is_empty() { NOTHING.to_owned() } else { why },
    ]
}

fn row_of_identification(found: &Identification) -> [String; 7] {
    [
        utc(found.time_unix_ns),
        found.module.to_string(),
        found.sequence.to_string(),
        found.component.component.to_string(),
        if found.decided { "identified" } else { "not identified" }.to_owned(),
        found.as_of_step.to_string(),
        identified(found),
    ]
}

fn colour(entry: &Entry<'_>) -> Option<Colour> {
    match entry {
        Entry::Transition(transition) => Some(state_colour(transition.state())),
        Entry::Identification(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::testing::identification;
    use crate::history::merge::{Order, merged};
    use crate::history::testing::{acknowledged, history, transition};
    use observer::ModuleHistory;

    #[test]
    fn the_table_is_this() {
        let identifications = vec![Identification {
            time_unix_ns: 500_000_000,
            ..identification(false, &["bias", "drift"])
        }];
        let journal = history("m1", vec![transition("m1", 1, 0), acknowledged("m1", 2)]);
        let histories = vec![ModuleHistory { identifications, ..journal }];
        let reading = Reading { since: 1, histories, silent: Vec::new() };
        let paint = Paint::for_terminal(false);
        let text =
            report(&reading, &merged(&reading.histories, Order::Time, |_| true, None), None, paint);
        let text: Vec<&str> = text.lines().map(str::trim_end).collect();
        let expected = "
  time                       module   sequence   component   state            step   why
───────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────
  1970-01-01T00:00:00.000Z   m1              1   sensor/g1   latched             7   -
  1970-01-01T00:00:00.500Z   m1              1   sensor/g2   not identified    142   bias or drift: not yet decided
  1970-01-01T00:00:01.000Z   m1              2   sensor/g1   acknowledged        7   acknowledged by ada@station: looks loose";
        let text = format!("\n{}", text.join("\n"));
        assert_eq!(text, expected, "{text}");
    }

    #[test]
    fn journals_without_transitions_are_reported_as_such() {
        let reading =
            Reading { since: 1, histories: vec![history("m1", vec![])], silent: Vec::new() };
        assert_eq!(report(&reading, &[], None, Paint::for_terminal(false)), "no transitions\n");
    }

    #[test]
    fn on_a_terminal_cells_take_several_lines_and_words_stay_whole() {
        let histories = vec![history("m1", vec![transition("m1", 1, 0), acknowledged("m1", 2)])];
        let reading = Reading { since: 1, histories, silent: Vec::new() };
        let entries = merged(&reading.histories, Order::Time, |_| true, None);
        let text = report(&reading, &entries, Some(80), Paint::for_terminal(false));
        assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
        for word in ["1970-01-01", "00:00:01.000Z", "sensor/g1", "acknowledged", "ada@station:"] {
            assert!(text.contains(word), "{text}");
        }
    }
}
