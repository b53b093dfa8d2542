//! The journals of several modules as one.

use std::collections::{BTreeMap, VecDeque};

use names::{ComponentPath, RunId, Step};
use observer::ModuleHistory;
use wire::{FaultTransition, Identification};

/// Something that a journal holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Entry<'a> {
    Transition(&'a FaultTransition),
    Identification(&'a Identification),
}

/// What is wanted, in the order given, of everything or, with a limit, of the latest. The transitions of a module
/// stay in the order of their sequence numbers, even if its clock was set back, and what a fault is comes after it.
pub(super) fn merged(
    histories: &[ModuleHistory],
    order: Order,
    wanted: impl Fn(&ComponentPath) -> bool,
    limit: Option<usize>,
) -> Vec<Entry<'_>> {
    let mut rest: Vec<VecDeque<Dated<'_>>> = histories.iter().map(dated).collect();
    for entries in &mut rest {
        entries.retain(|(_, entry)| wanted(entry.component()));
    }
    let mut merged = Vec::new();
    while let Some(place) = next(&rest, order) {
        merged.extend(rest[place].pop_front().map(|(_, entry)| entry));
    }
    let skipped = limit.map_or(0, |limit| merged.len().saturating_sub(limit));
    merged.split_off(skipped)
}

/// By what the entries of different modules are ordered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    /// By the clocks of the modules.
    Time,
    /// Those of one run by its steps, others by time: the clocks contradict each other.
    Steps,
}

/// Which module's next entry comes first: the earliest one, or that with the earliest step of the same run.
fn next(rest: &[VecDeque<Dated<'_>>], order: Order) -> Option<usize> {
    let heads = || rest.iter().enumerate().filter_map(|(place, left)| Some((place, left.front()?)));
    let (place, (_, earliest)) = heads().min_by_key(|(_, (time, _))| *time)?;
    let run = earliest.point().filter(|_| order == Order::Steps).map(|(run, _)| run);
    let of_run = |(place, (time, entry)): (usize, &Dated<'_>)| {
        let (_, step) = entry.point().filter(|(entry_run, _)| Some(*entry_run) == run)?;
        Some((step, *time, place))
    };
    Some(heads().filter_map(of_run).min().map_or(place, |(_, _, place)| place))
}

/// An entry and its time, which is never before that of the one before it.
type Dated<'a> = (u64, Entry<'a>);

impl Entry<'_> {
    fn component(&self) -> &ComponentPath {
        match self {
            Entry::Transition(transition) => &transition.component,
            Entry::Identification(found) => &found.component,
        }
    }

    /// Run and step as of which it was found. An order has only its time.
    fn point(&self) -> Option<(RunId, Step)> {
        match self {
            Entry::Transition(transition) if transition.order.is_some() => None,
            Entry::Transition(transition) => transition.run.zip(transition.decided_step),
            Entry::Identification(found) => Some((found.run, found.as_of_step)),
        }
    }
}

fn dated(history: &ModuleHistory) -> VecDeque<Dated<'_>> {
    let mut latest = 0;
    let mut declared = BTreeMap::new();
    let mut dated = Vec::new();
    for transition in &history.transitions {
        latest = latest.max(transition.time_unix_ns);
        declared.insert(transition.sequence, latest);
        dated.push((latest, Entry::Transition(transition)));
    }
    for found in &history.identifications {
        let declared = declared.get(&found.sequence).copied().unwrap_or_default();
        dated.push((found.time_unix_ns.max(declared), Entry::Identification(found)));
    }
    // Stable: what has the same time stays in order.
    dated.sort_by_key(|(time, _)| *time);
    dated.into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::testing::identification;
    use crate::history::testing::{history, transition};

    fn entries(limit: Option<usize>, wanted: impl Fn(&ComponentPath) -> bool) -> Vec<String> {
        let found = |sequence, time_unix_ns| Identification {
            sequence,
            time_unix_ns,
            ..identification(true, &["bias"])
        };
        let first = ModuleHistory {
            identifications: vec![found(1, 7), found(2, 35)],
            ..history("m1", vec![transition("m1", 1, 10), transition("m1", 2, 30)])
        };
        let second = history(
            "m2",
            vec![transition("m2", 4, 20), transition("m2", 5, 5), transition("m2", 6, 40)],
        );
        let histories = [first, second];
        let merged = merged(&histories, Order::Time, wanted, limit);
        let text = |entry: &Entry<'_>| match entry {
            Entry::Transition(t) => format!("{}.{}", t.module, t.sequence),
            Entry::Identification(found) => format!("{}.{} is known", found.module, found.sequence),
        };
        merged.iter().map(text).collect()
    }

    #[test]
    fn modules_are_merged_by_time_and_each_keeps_its_order() {
        let expected = ["m1.1", "m1.1 is known", "m2.4", "m2.5", "m1.2", "m1.2 is known", "m2.6"];
        assert_eq!(entries(None, |_| true), expected);
    }

    #[test]
    fn a_limit_keeps_the_latest_of_those_wanted() {
        assert_eq!(entries(Some(2), |_| true), ["m1.2 is known", "m2.6"]);
        let of_first = entries(Some(3), |component| component.module.as_str() == "m1");
        assert_eq!(of_first, ["m1.1 is known", "m1.2", "m1.2 is known"]);
    }

    #[test]
    fn clocks_that_contradict_each_other_do_not_change_the_order_of_steps() {
        let at = |module: &str, sequence, run, step, time_unix_ns| FaultTransition {
            run: Some(RunId(run)),
            decided_step: Some(Step(step)),
            ..transition(module, sequence, time_unix_ns)
        };
        // Its clock is ahead.
        let first = history("m1", vec![at("m1", 1, 1, 100, 5100), at("m1", 2, 1, 300, 5300)]);
        let second = history(
            "m2",
            vec![at("m2", 1, 1, 50, 50), at("m2", 2, 1, 200, 200), at("m2", 3, 1, 400, 400)],
        );
        let histories = [first, second];
        let names = |order| -> Vec<String> {
            let entries = merged(&histories, order, |_| true, None);
            let name = |entry: &Entry<'_>| match entry {
                Entry::Transition(t) => format!("{}.{}", t.module, t.sequence),
                Entry::Identification(_) => String::new(),
            };
            entries.iter().map(name).collect()
        };
        assert_eq!(names(Order::Steps), ["m2.1", "m1.1", "m2.2", "m1.2", "m2.3"]);
        assert_eq!(names(Order::Time), ["m2.1", "m2.2", "m2.3", "m1.1", "m1.2"]);
    }
}
