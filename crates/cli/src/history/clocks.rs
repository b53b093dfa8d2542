//! Whether the clocks of the modules agree, as far as their journals show it: modules count the same steps, so
//! what was decided at an earlier step should have the earlier time.

use std::time::Duration;

use names::{ModuleName, RunId, Step, StructureName};
use observer::ModuleHistory;
use wire::FaultTransition;

/// Less than this may have other reasons, such as a decision that waited for a peer.
const AGREE_WITHIN: Duration = Duration::from_secs(2);

/// A module whose times are later than those of another one, by the order of their steps.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Contradiction<'a> {
    pub(super) structure: &'a StructureName,
    pub(super) ahead: &'a ModuleName,
    pub(super) behind: &'a ModuleName,
    /// At least by this.
    pub(super) by: Duration,
}

/// The modules whose times contradict the order of their steps.
pub(super) fn contradictions(histories: &[ModuleHistory]) -> Vec<Contradiction<'_>> {
    let pairs = histories.iter().flat_map(|a| histories.iter().map(move |b| (a, b)));
    let found = |(ahead, behind): (&'_ ModuleHistory, &'_ ModuleHistory)| {
        if ahead.structure != behind.structure || ahead.module == behind.module {
            return None;
        }
        lead(&points(ahead), &points(behind)).filter(|by| *by > AGREE_WITHIN)
    };
    let contradiction = |(a, b): (_, _)| found((a, b)).map(|by| of(a, b, by));
    pairs.filter_map(contradiction).collect()
}

fn of<'a>(ahead: &'a ModuleHistory, behind: &'a ModuleHistory, by: Duration) -> Contradiction<'a> {
    Contradiction { structure: &ahead.structure, ahead: &ahead.module, behind: &behind.module, by }
}

/// Run and step, and the time given for it \[ns since 1970\].
type Point = (RunId, Step, u64);

/// What was decided at a step. An order comes at any time, also long after the latest step.
fn points(history: &ModuleHistory) -> Vec<Point> {
    let point = |transition: &FaultTransition| {
        let (run, step) = transition.run.zip(transition.decided_step)?;
        transition.order.is_none().then_some((run, step, transition.time_unix_ns))
    };
    let mut points: Vec<Point> = history.transitions.iter().filter_map(point).collect();
    points.sort_unstable();
    points
}

/// By how much the first is later than the second at the most where its step is the earlier one.
fn lead(first: &[Point], second: &[Point]) -> Option<Duration> {
    let mut later = second.iter().rev().peekable();
    // Of the second, at later steps of the run at hand.
    let mut earliest: Option<(RunId, u64)> = None;
    let mut longest = None;
    for (run, step, time) in first.iter().rev() {
        while let Some((other_run, _, other)) =
            later.next_if(|point| (point.0, point.1) > (*run, *step))
        {
            let before = earliest.filter(|(known, _)| known == other_run).map(|(_, time)| time);
            earliest = Some((*other_run, before.unwrap_or(u64::MAX).min(*other)));
        }
        if let Some((_, other)) = earliest.filter(|(known, other)| known == run && other < time) {
            longest = longest.max(Some(Duration::from_nanos(time - other)));
        }
    }
    longest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::history::testing::{history, transition};

    fn at(module: &str, run: u64, step: u64, second: u64) -> FaultTransition {
        FaultTransition {
            run: Some(RunId(run)),
            decided_step: Some(Step(step)),
            ..transition(module, step + 1, second * 1_000_000_000)
        }
    }

    fn found(histories: &[ModuleHistory]) -> Vec<(String, String, u64)> {
        let contradictions = contradictions(histories);
        let text =
            |c: &Contradiction<'_>| (c.ahead.to_string(), c.behind.to_string(), c.by.as_secs());
        contradictions.iter().map(text).collect()
    }

    #[test]
    fn a_clock_that_is_ahead_is_found_by_the_steps() {
        let ahead = history("m1", vec![at("m1", 1, 1000, 3610), at("m1", 1, 3000, 3630)]);
        let right = history("m2", vec![at("m2", 1, 500, 5), at("m2", 1, 2000, 20)]);
        let third = history("m3", vec![at("m3", 1, 2500, 25)]);
        let expected = [("m1", "m2", 3590), ("m1", "m3", 3585)];
        let expected = expected.map(|(a, b, by)| (a.to_owned(), b.to_owned(), by));
        assert_eq!(found(&[ahead, right, third]), expected);
    }

    #[test]
    fn clocks_that_agree_and_steps_of_different_runs_are_not_noted() {
        let first = history("m1", vec![at("m1", 1, 1000, 11), at("m1", 2, 10, 100)]);
        let second = history("m2", vec![at("m2", 1, 1001, 10), at("m2", 3, 20, 50)]);
        assert_eq!(found(&[first, second]), []);
    }

    #[test]
    fn an_order_given_long_after_the_latest_step_is_no_contradiction() {
        let order = crate::history::testing::acknowledged("m1", 2).order;
        let late = FaultTransition { order, ..at("m1", 1, 1000, 3600) };
        let histories = [history("m1", vec![late]), history("m2", vec![at("m2", 1, 2000, 20)])];
        assert_eq!(found(&histories), []);
    }
}
