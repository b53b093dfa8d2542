//! What is missing from the journals, and what contradicts itself in them.

use observer::ModuleHistory;

use super::clocks::{Contradiction, contradictions};
use super::reading::Reading;
use wording::printable;

/// One note for each thing that is missing, and for each pair of modules whose clocks cannot both be right.
pub(super) fn notes(reading: &Reading) -> Vec<String> {
    let mut notes: Vec<String> = reading
        .silent
        .iter()
        .map(|silent| {
            let reason = &silent.reason;
            format!("{}: {reason}; nothing is known of its history", silent.module)
        })
        .collect();
    for history in &reading.histories {
        notes.extend(cut_off(history, reading.since));
        notes.extend(broken_off(history));
    }
    for (history, gap) in reading.gaps() {
        let module = &history.module;
        notes.push(if gap.from == gap.to {
            format!("{module}: transition {} is missing from the journal", gap.from)
        } else {
            format!("{module}: transitions {} to {} are missing from the journal", gap.from, gap.to)
        });
    }
    notes.extend(contradictions(&reading.histories).iter().map(clocks));
    notes
}

fn clocks(found: &Contradiction<'_>) -> String {
    let Contradiction { ahead, behind, by, .. } = found;
    format!(
        "by the order of steps, which is that of this table, the clock of {ahead} is at least {} s \
         ahead of that of {behind}; check time synchronisation",
        by.as_secs()
    )
}

/// A journal that no longer holds everything asked for.
fn cut_off(history: &ModuleHistory, since: u64) -> Option<String> {
    let module = &history.module;
    match (history.first_sequence, history.next_sequence) {
        (Some(first), _) if first > since.max(1) => {
            Some(format!("{module}: the journal reaches back to transition {first} only"))
        }
        (None, Some(next)) if next > since.max(1) => Some(format!(
            "{module}: the journal holds none of the {} transitions up to now",
            next - 1
        )),
        _ => None,
    }
}

fn broken_off(history: &ModuleHistory) -> Option<String> {
    let error = printable(&history.broken_off.as_ref()?.to_string());
    let after = history.transitions.last().map_or(0, |transition| transition.sequence);
    Some(format!("{}: nothing was read after transition {after}: {error}", history.module))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::history::merge::Order;
    use crate::history::reading::Silent;
    use crate::history::testing::{history, transition};
    use names::{RunId, Step};
    use observer::QueryError;
    use std::time::Duration;
    use wire::FaultTransition;

    #[test]
    fn everything_that_is_missing_is_noted() {
        let mut cut = history("m1", vec![transition("m1", 5, 1), transition("m1", 7, 2)]);
        (cut.first_sequence, cut.next_sequence) = (Some(5), Some(10));
        let mut broken = history("m2", vec![transition("m2", 1, 1)]);
        broken.next_sequence = Some(4);
        broken.broken_off = Some(QueryError::Unanswered(Duration::from_secs(3)));
        let mut empty = history("m3", Vec::new());
        (empty.first_sequence, empty.next_sequence) = (None, Some(3));
        let silent = Silent {
            structure: None,
            module: "m4".parse().unwrap(),
            reason: "no answer within 3s".to_owned(),
        };
        let reading =
            Reading { since: 1, histories: vec![cut, broken, empty], silent: vec![silent] };
        assert_eq!(
            notes(&reading),
            [
                "m4: no answer within 3s; nothing is known of its history",
                "m1: the journal reaches back to transition 5 only",
                "m2: nothing was read after transition 1: no answer within 3s",
                "m3: the journal holds none of the 2 transitions up to now",
                "m1: transition 6 is missing from the journal",
                "m1: transitions 8 to 9 are missing from the journal",
            ]
        );
    }

    #[test]
    fn clocks_that_contradict_the_order_of_steps_are_noted() {
        let at = |module: &str, step, second: u64| FaultTransition {
            run: Some(RunId(1)),
            decided_step: Some(Step(step)),
            ..transition(module, 1, second * 1_000_000_000)
        };
        let histories =
            vec![history("m1", vec![at("m1", 7, 3607)]), history("m2", vec![at("m2", 8, 8)])];
        let reading = Reading { since: 1, histories, silent: Vec::new() };
        assert_eq!(reading.order(), Order::Steps);
        let expected = "by the order of steps, which is that of this table, the clock of m1 is at least \
                        3599 s ahead of that of m2; check time synchronisation";
        assert_eq!(notes(&reading), [expected]);
    }

    #[test]
    fn a_journal_that_holds_everything_needs_no_note() {
        let whole = history("m1", vec![transition("m1", 1, 1), transition("m1", 2, 2)]);
        let untouched = history("m2", Vec::new());
        let reading = Reading { since: 1, histories: vec![whole, untouched], silent: Vec::new() };
        assert!(notes(&reading).is_empty(), "{:?}", notes(&reading));
    }
}
