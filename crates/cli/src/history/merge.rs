//! The journals of several modules as one.

use observer::ModuleHistory;
use wire::FaultTransition;

/// The wanted transitions by time; those of a module stay in the order of their sequence numbers, even
/// if its clock was set back. With a limit, only the latest.
pub(super) fn merged(
    histories: &[ModuleHistory],
    wanted: impl Fn(&FaultTransition) -> bool,
    limit: Option<usize>,
) -> Vec<&FaultTransition> {
    let mut timed: Vec<(u64, &FaultTransition)> = Vec::new();
    for history in histories {
        let mut latest = 0;
        for transition in &history.transitions {
            latest = latest.max(transition.time_unix_ns);
            if wanted(transition) {
                timed.push((latest, transition));
            }
        }
    }
    // Stable: what has the same time stays in order.
    timed.sort_by_key(|(time, _)| *time);
    let skipped = limit.map_or(0, |limit| timed.len().saturating_sub(limit));
    timed.into_iter().skip(skipped).map(|(_, transition)| transition).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::history::testing::{history, transition};

    fn sequences(limit: Option<usize>, wanted: impl Fn(&FaultTransition) -> bool) -> Vec<String> {
        let histories = [
            history("m1", vec![transition("m1", 1, 10), transition("m1", 2, 30)]),
            history(
                "m2",
                vec![transition("m2", 4, 20), transition("m2", 5, 5), transition("m2", 6, 40)],
            ),
        ];
        let merged = merged(&histories, wanted, limit);
        merged.iter().map(|t| format!("{}.{}", t.module, t.sequence)).collect()
    }

    #[test]
    fn modules_are_merged_by_time_and_each_keeps_its_order() {
        assert_eq!(sequences(None, |_| true), ["m1.1", "m2.4", "m2.5", "m1.2", "m2.6"]);
    }

    #[test]
    fn a_limit_keeps_the_latest_of_those_wanted() {
        assert_eq!(sequences(Some(2), |_| true), ["m1.2", "m2.6"]);
        assert_eq!(sequences(Some(2), |t| t.module.as_str() == "m1"), ["m1.1", "m1.2"]);
    }
}
