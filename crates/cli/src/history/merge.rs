//! The journals of several modules as one.

use std::collections::BTreeMap;

use names::ComponentPath;
use observer::ModuleHistory;
use wire::{FaultTransition, Identification};

/// Something that a journal holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Entry<'a> {
    Transition(&'a FaultTransition),
    Identification(&'a Identification),
}

/// What is wanted, by time; the transitions of a module stay in the order of their sequence numbers, even if its clock
/// was set back, and what a fault is comes after it. With a limit, only the latest.
pub(super) fn merged(
    histories: &[ModuleHistory],
    wanted: impl Fn(&ComponentPath) -> bool,
    limit: Option<usize>,
) -> Vec<Entry<'_>> {
    let mut timed: Vec<(u64, Entry<'_>)> = histories.iter().flat_map(dated).collect();
    timed.retain(|(_, entry)| wanted(entry.component()));
    // Stable: what has the same time stays in order.
    timed.sort_by_key(|(time, _)| *time);
    let skipped = limit.map_or(0, |limit| timed.len().saturating_sub(limit));
    timed.into_iter().skip(skipped).map(|(_, entry)| entry).collect()
}

impl Entry<'_> {
    fn component(&self) -> &ComponentPath {
        match self {
            Entry::Transition(transition) => &transition.component,
            Entry::Identification(found) => &found.component,
        }
    }
}

fn dated(history: &ModuleHistory) -> Vec<(u64, Entry<'_>)> {
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
    dated
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
        let merged = merged(&histories, wanted, limit);
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
}
