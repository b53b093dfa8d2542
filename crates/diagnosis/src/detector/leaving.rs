//! When does an earlier change leave the sliding interval? That changes the Gaussian once more.

use std::collections::VecDeque;

use super::{ChannelGroup, Tuning};
use crate::divergence::DivergenceOutcome;

/// The changes of a channel whose samples the interval still holds.
#[derive(Debug, Clone)]
pub(super) struct Leaving {
    /// M, if the interval slides and its end is of interest.
    interval: Option<u64>,
    /// Vectors before its leaving in which a change may show already.
    before: u64,
    /// Vectors after it in which it still shows.
    after: u64,
    /// The channel's vectors with which each change began and ended.
    changes: VecDeque<[u64; 2]>,
    age: u64,
}

impl Leaving {
    pub(super) fn new(group: &ChannelGroup, tuning: &Tuning) -> Leaving {
        let (window, lag) = (group.settings.window as u64, group.settings.lag as u64);
        let interval = group.settings.interval.vectors().filter(|_| group.marks_leaving);
        let interval = interval.map(|vectors| vectors as u64);
        let shows = few(tuning.threshold, lag) + window + lag;
        Leaving {
            interval,
            before: shows.min(interval.unwrap_or(0) / 2),
            after: window + lag + group.quiet_steps,
            changes: VecDeque::new(),
            age: 0,
        }
    }

    /// Takes what a channel's divergence is, and whether it counts as a change. Is an earlier one leaving?
    pub(super) fn observe(&mut self, outcome: DivergenceOutcome, change: bool) -> bool {
        let (Some(interval), DivergenceOutcome::Defined { age, .. }) = (self.interval, outcome)
        else {
            return false;
        };
        if age < self.age {
            self.changes.clear();
        }
        self.age = age;
        while self.changes.front().is_some_and(|[_, end]| end + interval + self.after < age) {
            self.changes.pop_front();
        }
        let leaving =
            self.changes.front().is_some_and(|[begin, _]| age + self.before >= begin + interval);
        if change && !leaving {
            match self.changes.back_mut() {
                Some([_, end]) if *end + 1 == age => *end = age,
                _ => self.changes.push_back([age, age]),
            }
        }
        leaving
    }
}

/// How few vectors from before a step are left in the interval when it shows that they leave. Their scatter about
/// the new mean outweighs all other, so D = (r - 1 - ln r)/2 when their number falls to its r-th part within a lag.
fn few(threshold: f64, lag: u64) -> u64 {
    let divergence = |excess: f64| 0.5 * (excess - excess.ln_1p());
    let (mut low, mut high) = (1e-9, 1e9);
    for _ in 0..100 {
        let middle = f64::sqrt(low * high);
        if divergence(middle) < threshold { low = middle } else { high = middle }
    }
    (lag as f64 * (1.0 + high) / high).ceil() as u64
}

#[cfg(test)]
mod tests {
    use super::super::GapRule;
    use super::*;
    use crate::divergence::{DivergenceSettings, Interval};

    #[test]
    fn a_change_leaves_an_interval_after_it_came() {
        let group = ChannelGroup {
            settings: DivergenceSettings {
                window: 2,
                lag: 3,
                interval: Interval::Sliding { vectors: 100 },
            },
            warm_up: 0,
            quiet_steps: 1,
            gaps: GapRule::OPEN,
            marks_leaving: true,
            channels: Vec::new(),
        };
        let mut leaving = Leaving::new(&group, &Tuning { prior_scatter: 1.0, threshold: 0.5 });
        let mut observe = |age: u64| {
            let outcome = DivergenceOutcome::Defined { divergence: 0.0, age };
            leaving.observe(outcome, (40..45).contains(&age))
        };
        let found: Vec<u64> = (1..300).filter(|&age| observe(age)).collect();
        assert_eq!((found.first(), found.last()), (Some(&130), Some(&150)));
    }

    #[test]
    fn the_smaller_the_threshold_the_earlier_it_shows() {
        assert_eq!(
            [5.0, 0.5, 0.005, f64::INFINITY].map(|threshold| few(threshold, 10)),
            [11, 15, 78, 11]
        );
    }
}
