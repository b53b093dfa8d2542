//! Which steps of a run the module has watched with every channel. A diagnoser that was restarted or
//! lost a channel for a while knows nothing of the steps between.

use std::collections::VecDeque;

use vocabulary::Step;

/// Most stretches remembered.
const MAX_STRETCHES: usize = 16;

/// The stretches of steps that were watched without a break.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct Coverage {
    /// Ended ones, oldest first: from, until.
    closed: VecDeque<(Step, Step)>,
    /// The present one begins here.
    open: Option<Step>,
    /// Where samples are missing, oldest first: the last step before, the first after.
    gaps: VecDeque<(Step, Step)>,
}

impl Coverage {
    /// What was watched before a restart.
    pub(crate) fn recalled(since: Step, until: Step) -> Self {
        Self { closed: VecDeque::from([(since, until)]), ..Self::default() }
    }

    /// Watching goes on, or begins, at `step`. A stretch that reaches this far is continued.
    pub(crate) fn watch(&mut self, step: Step) {
        if self.open.is_some() {
            return;
        }
        let continued =
            self.closed.pop_back_if(|(from, until)| *from <= step && until.plus(1) >= step);
        self.open = Some(continued.map_or(step, |(from, _)| from));
    }

    /// Watching ends; `until` was the last step watched.
    pub(crate) fn lose(&mut self, until: Step) {
        let Some(from) = self.open.take() else { return };
        if self.closed.len() == MAX_STRETCHES {
            self.closed.pop_front();
        }
        self.closed.push_back((from, until.max(from)));
    }

    /// Since when is the module watching now?
    pub(crate) fn watched_since(&self) -> Option<Step> {
        self.open
    }

    /// Since when has the module been watching without a break up to `as_of`?
    pub(crate) fn since(&self, as_of: Step) -> Option<Step> {
        if let Some(open) = self.open.filter(|open| *open <= as_of) {
            return Some(open);
        }
        let stretch = self.closed.iter().find(|(from, until)| (from..=until).contains(&&as_of));
        stretch.map(|(from, _)| *from)
    }

    /// Samples are missing between these two, and the models are carried across.
    pub(crate) fn cross(&mut self, last: Step, next: Step) {
        self.lose(last);
        if self.gaps.len() == MAX_STRETCHES {
            self.gaps.pop_front();
        }
        self.gaps.push_back((last, next));
    }

    /// The latest gaps that the models were carried across: the last step before, the first after.
    pub(crate) fn gaps(&self) -> impl Iterator<Item = (Step, Step)> {
        self.gaps.iter().copied()
    }

    /// Was the module watching from `from` to `as_of`? `None`: it may still turn out, for samples from
    /// before may still come.
    pub(crate) fn knows(&self, from: Step, as_of: Step) -> Option<bool> {
        if self.since(as_of).is_some_and(|since| since <= from) {
            return Some(true);
        }
        self.open.is_some_and(|open| open > from).then_some(false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stretch_is_known_up_to_its_end_and_nothing_between_two() {
        let mut coverage = Coverage::recalled(Step(10), Step(20));
        assert_eq!(coverage.since(Step(20)), Some(Step(10)));
        assert_eq!(coverage.since(Step(21)), None);
        assert_eq!(coverage.knows(Step(12), Step(15)), Some(true));
        assert_eq!(coverage.knows(Step(12), Step(25)), None);
        coverage.watch(Step(30));
        coverage.watch(Step(31));
        assert_eq!(coverage.knows(Step(12), Step(25)), Some(false));
        assert_eq!(coverage.since(Step(25)), None);
        assert_eq!(coverage.since(Step(40)), Some(Step(30)));
        coverage.lose(Step(50));
        assert_eq!((coverage.since(Step(50)), coverage.since(Step(51))), (Some(Step(30)), None));
    }

    #[test]
    fn samples_given_again_close_the_gap() {
        let mut coverage = Coverage::recalled(Step(10), Step(20));
        coverage.watch(Step(15));
        assert_eq!(coverage.since(Step(40)), Some(Step(10)));
        let mut adjacent = Coverage::recalled(Step(10), Step(20));
        adjacent.watch(Step(21));
        assert_eq!(adjacent.since(Step(40)), Some(Step(10)));
    }
}
