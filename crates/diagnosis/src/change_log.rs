//! A module's own changes, to be reported to peers.

use std::collections::VecDeque;

use names::Step;

use crate::change::LoggedChange;
use crate::question::MAX_CHANGES_IN_ANSWER;

/// The latest changes of the module's channels, oldest first; as many as an answer may carry.
#[derive(Debug, Clone, Default)]
pub(crate) struct ChangeLog {
    changes: VecDeque<LoggedChange>,
    /// Changes up to here were forgotten.
    forgotten_until: Option<Step>,
    /// How many of the latest changes may still grow.
    fresh: usize,
}

impl ChangeLog {
    pub(crate) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Adds a change; the oldest one is forgotten when there are too many.
    pub(crate) fn push(&mut self, change: LoggedChange) {
        if self.changes.len() == MAX_CHANGES_IN_ANSWER {
            self.forgotten_until = self.changes.pop_front().map(|oldest| oldest.step);
            self.fresh = self.fresh.min(self.changes.len());
        }
        let later = self.changes.iter().rev().take_while(|c| c.step > change.step).count();
        if later > 0 {
            // Only while old samples are replayed after a restart: too old to be reported as new.
            self.changes.insert(self.changes.len() - later, change);
            return;
        }
        self.changes.push_back(change);
        self.fresh += 1;
    }

    /// Takes up what was known before a restart, oldest first; it does not grow any more.
    pub(crate) fn recall(&mut self, changes: impl IntoIterator<Item = LoggedChange>) {
        changes.into_iter().for_each(|change| self.push(change));
        self.fresh = 0;
    }

    /// Was this change, or one of the same channel at most `tie` steps away, recalled? Then it was seen
    /// before the restart, and its ratio is raised to the present one.
    pub(crate) fn merge_repeat(
        &mut self,
        channel: usize,
        step: Step,
        tie: u64,
        ratio: f64,
    ) -> bool {
        let near = |c: &&mut LoggedChange| {
            c.channel == channel && c.step <= step.plus(tie) && step <= c.step.plus(tie)
        };
        let again = self.changes.iter_mut().rev().find(near);
        again.map(|change| change.raise(ratio)).is_some()
    }

    /// The next change whose ratio is final at `now`; each is returned once.
    pub(crate) fn settle(&mut self, now: Step, tie: u64) -> Option<&LoggedChange> {
        let place = self.changes.len().checked_sub(self.fresh.max(1))?;
        let settled = self.fresh > 0 && self.changes[place].step.plus(tie) <= now;
        if !settled {
            return None;
        }
        self.fresh -= 1;
        self.changes.get(place)
    }

    /// Lets the ratios of changes within the last `tie` steps grow.
    pub(crate) fn follow(&mut self, step: Step, tie: u64, ratio: impl Fn(usize) -> f64) {
        let recent = self.changes.iter_mut().rev().skip_while(|change| change.step > step);
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
