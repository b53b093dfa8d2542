//! A module's own changes, to be told to peers.

use std::collections::VecDeque;

use truss::ids::Step;

use crate::change::LoggedChange;
use crate::question::MAX_CHANGES_IN_ANSWER;

/// The latest changes of the module's channels, oldest first; as many as an answer may carry.
#[derive(Debug, Clone, Default)]
pub(crate) struct ChangeLog {
    changes: VecDeque<LoggedChange>,
    /// Changes up to here were forgotten.
    forgotten_until: Option<Step>,
}

impl ChangeLog {
    pub(crate) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Adds a change; the oldest one is forgotten when there are too many.
    pub(crate) fn push(&mut self, change: LoggedChange) {
        if self.changes.len() == MAX_CHANGES_IN_ANSWER {
            self.forgotten_until = self.changes.pop_front().map(|oldest| oldest.step);
        }
        self.changes.push_back(change);
    }

    /// Lets the ratios of changes within the last `tie` steps grow.
    pub(crate) fn follow(&mut self, step: Step, tie: u64, ratio: impl Fn(usize) -> f64) {
        let recent = self.changes.iter_mut().rev();
        for change in recent.take_while(|change| step.since(change.step) <= tie) {
            let ratio = ratio(change.channel);
            change.follow(step, ratio, usize::try_from(tie).unwrap_or(usize::MAX));
        }
    }

    /// The changes from `from` to `until`, both included.
    pub(crate) fn between(&self, from: Step, until: Step) -> impl Iterator<Item = &LoggedChange> {
        let start = self.changes.partition_point(|change| change.step < from);
        let end = self.changes.partition_point(|change| change.step <= until);
        self.changes.range(start..end.max(start))
    }

    /// The first step from which every change is still known.
    pub(crate) fn known_from(&self) -> Step {
        self.forgotten_until.map_or(Step(0), |until| until.plus(1))
    }
}
