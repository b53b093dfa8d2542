//! The journals in readable form.

use std::fmt::Write;

use observer::Journals;

use super::reading::JournalReading;
use crate::paint::{Colour, Paint, tone_colour};
use crate::table::table;
use vocabulary::words::{NOTHING, or_nothing, utc};

const HEADING: [&str; 7] = ["time", "module", "sequence", "component", "state", "step", "why"];

/// The text: transitions, kinds of faults, and gaps in the journals.
pub(super) fn report(
    reading: &JournalReading,
    journals: &Journals<'_>,
    width: Option<u16>,
    paint: Paint,
) -> String {
    let mut text = String::new();
    let mut table = table(&HEADING);
    let mut colours = Vec::new();
    for entry in &journals.entries {
        let line = entry.line();
        table.add_row([
            utc(line.time_unix_ns),
            or_nothing(line.module),
            or_nothing(entry.sequence()),
            or_nothing(entry.component().map(|path| &path.component)),
            line.what,
            or_nothing(line.step),
            if line.why.is_empty() { NOTHING.to_owned() } else { line.why },
        ]);
        colours.push(tone_colour(line.tone));
    }
    table.align_right([2, 5]);
    table.break_times(0);
    table.stack(&[&[0], &[1, 2], &[3], &[4, 5], &[6]]);
    // Writing to a string does not fail.
    if !colours.is_empty() {
        let _ = writeln!(text, "{}", table.painted(width, &colours, paint));
    } else if reading.is_of_anybody() {
        text.push_str("no transitions\n");
    }
    let clocks = journals.contradictions.iter().map(ToString::to_string);
    for note in reading.notes().chain(clocks) {
        let _ = writeln!(text, "{}", paint.in_colour(Colour::Yellow, &format!("note: {note}")));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use observer::ModuleHistory;
    use observer::testing::{acknowledged, history, identification, journaled};
    use vocabulary::Identification;

    #[test]
    fn the_table_is_this() {
        let identifications = vec![Identification {
            time_unix_ns: 500_000_000,
            ..identification(false, &["bias", "drift"])
        }];
        let journal = history("m1", vec![journaled("m1", 1, 0), acknowledged("m1", 2)]);
        let histories = vec![ModuleHistory { identifications, ..journal }];
        let reading = JournalReading { histories, silent: Vec::new() };
        let paint = Paint::NONE;
        let text = report(&reading, &Journals::merge(&reading.histories), None, paint);
        let text: Vec<&str> = text.lines().map(str::trim_end).collect();
        let expected = "
  time                       module   sequence   component   state            step   why
───────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────
  1970-01-01T00:00:00.000Z   m1              1   sensor/g1   latched             7   -
  1970-01-01T00:00:00.500Z   m1              1   sensor/g2   not identified    142   bias or drift: not yet decided
  1970-01-01T00:00:01.000Z   m1              2   sensor/g1   acknowledged        -   acknowledged by ada@station: looks loose";
        let text = format!("\n{}", text.join("\n"));
        assert_eq!(text, expected, "{text}");
    }

    #[test]
    fn journals_without_transitions_are_reported_as_such() {
        let reading = JournalReading { histories: vec![history("m1", vec![])], silent: Vec::new() };
        assert_eq!(
            report(&reading, &Journals::merge(&reading.histories), None, Paint::NONE),
            "no transitions\n"
        );
    }

    #[test]
    fn on_a_terminal_cells_take_several_lines_and_words_stay_whole() {
        let histories = vec![history("m1", vec![journaled("m1", 1, 0), acknowledged("m1", 2)])];
        let reading = JournalReading { histories, silent: Vec::new() };
        let journals = Journals::merge(&reading.histories);
        let text = report(&reading, &journals, Some(80), Paint::NONE);
        assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
        for word in ["1970-01-01", "00:00:01.000Z", "sensor/g1", "acknowledged", "ada@station:"] {
            assert!(text.contains(word), "{text}");
        }
    }
}
