//! A module's own changes, to be reported to peers.

use std::collections::VecDeque;

use vocabulary::Step;

use crate::change::LoggedChange;
use crate::question::MAX_CHANGES_IN_ANSWER;

/// The latest changes of the module's channels, oldest first; as many as an answer may carry.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct ChangeLog {
    /// Steps within which changes are simultaneous: so long their ratios may grow.
    tie: u64,
    /// A change ends after this many steps below its threshold.
    quiet_steps: u64,
    changes: VecDeque<LoggedChange>,
    /// Changes up to here were forgotten.
    forgotten_until: Option<Step>,
    /// How many of the latest changes may still grow.
    fresh: usize,
    /// Channel and step of the changes that have not ended.
    going_on: Vec<(usize, Step)>,
}

impl ChangeLog {
    pub(crate) fn new(tie: u64, quiet_steps: u64) -> Self {
        let (changes, going_on) = (VecDeque::new(), Vec::new());
        Self { tie, quiet_steps, changes, forgotten_until: None, fresh: 0, going_on }
    }

    pub(crate) fn clear(&mut self) {
        *self = Self::new(self.tie, self.quiet_steps);
    }

    /// Adds a change; the oldest one is forgotten when there are too many.
    pub(crate) fn push(&mut self, change: LoggedChange) {
        if self.changes.len() == MAX_CHANGES_IN_ANSWER {
            self.forgotten_until = self.changes.pop_front().map(|oldest| oldest.step);
            self.fresh = self.fresh.min(self.changes.len());
        }
        if !change.over {
            self.going_on.push((change.channel, change.step));
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

    /// Was this change, or one of the same channel at most a tie away, recalled? Then it was seen
    /// before the restart, and its ratio is raised to the present one.
    pub(crate) fn merge_repeat(&mut self, channel: usize, step: Step, ratio: f64) -> bool {
        let tie = self.tie;
        let near = |c: &&mut LoggedChange| {
            c.channel == channel && c.step <= step.plus(tie) && step <= c.step.plus(tie)
        };
        let again = self.changes.iter_mut().rev().find(near);
        again.map(|change| change.raise(ratio)).is_some()
    }

    /// The next change whose ratio is final at `now`; each is returned once.
    pub(crate) fn settle(&mut self, now: Step) -> Option<&LoggedChange> {
        let place = self.changes.len().checked_sub(self.fresh.max(1))?;
        let settled = self.fresh > 0 && self.changes[place].step.plus(self.tie) <= now;
        if !settled {
            return None;
        }
        self.fresh -= 1;
        self.changes.get(place)
    }

    /// A channel is still changing at this step, since its latest change. One that was recalled may be up to a tie
    /// ahead of it ([`Self::merge_repeat`]).
    pub(crate) fn prolong(&mut self, channel: usize, step: Step, ratio: f64) {
        let Self { tie, quiet_steps, .. } = *self;
        let latest = self.changes.iter_mut().rev();
        match latest.into_iter().find(|c| c.channel == channel && c.step <= step.plus(tie)) {
            Some(change) if change.step > step => {}
            // During a gap no step was seen below the threshold, but by the number of steps the earlier change has
            // ended.
            Some(change) if change.ended_as_of(step.minus(1), quiet_steps).is_some() => {
                self.push(LoggedChange::new(channel, step, step, ratio));
            }
            Some(change) => change.prolong(step),
            None => {}
        }
    }

    /// The next change that has ended by `now`; each is returned once.
    pub(crate) fn end(&mut self, now: Step) -> Option<(&LoggedChange, Step)> {
        let (changes, quiet_steps) = (&self.changes, self.quiet_steps);
        let found = |(channel, step): &(usize, Step)| {
            let from = changes.partition_point(|change| change.step < *step);
            let at = changes.range(from..).take_while(|change| change.step == *step);
            let at: Option<&LoggedChange> = at.into_iter().find(|c| c.channel == *channel);
            at
        };
        let ended = |place: &(usize, Step)| {
            found(place).is_none_or(|change| change.ended_as_of(now, quiet_steps).is_some())
        };
        let place = self.going_on.iter().position(ended)?;
        let place = self.going_on.swap_remove(place);
        let change = found(&place)?;
        Some((change, change.ended_as_of(now, quiet_steps)?))
    }

    /// The changes that had begun by `until` and were not over before `from`, oldest first.
    pub(crate) fn overlapping(
        &self,
        from: Step,
        until: Step,
    ) -> impl Iterator<Item = &LoggedChange> {
        let quiet_steps = self.quiet_steps;
        let end = self.changes.partition_point(|change| change.step <= until);
        let is_over = move |c: &LoggedChange| c.ended_as_of(from, quiet_steps).is_some();
        self.changes.range(..end).filter(move |change| !is_over(change))
    }

    /// Lets the ratios of changes within the latest tie grow.
    pub(crate) fn follow(&mut self, step: Step, ratio: impl Fn(usize) -> f64) {
        let tie = self.tie;
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

#[cfg(test)]
mod tests {
    use super::*;

    const QUIET: u64 = 40;
    const TIE: u64 = 3;

    /// A log in which channel 0 changes at step 100 and stays above its threshold until 150.
    fn log() -> ChangeLog {
        let mut log = ChangeLog::new(TIE, QUIET);
        log.push(LoggedChange::new(0, Step(95), Step(100), 2.0));
        (101..=150).for_each(|step| log.prolong(0, Step(step), 2.0));
        log
    }

    fn overlapping(log: &ChangeLog, from: u64, until: u64) -> usize {
        log.overlapping(Step(from), Step(until)).count()
    }

    #[test]
    fn a_change_is_reported_from_its_step_on_until_it_is_over() {
        let log = log();
        assert_eq!(
            [(0, 99), (0, 100), (189, 300)].map(|(a, b)| overlapping(&log, a, b)),
            [0, 1, 1]
        );
        assert_eq!(overlapping(&log, 190, 300), 0);
    }

    #[test]
    fn its_end_as_of_a_step_is_the_same_whenever_it_is_asked_for() {
        let mut log = log();
        let ended = |log: &ChangeLog, step| {
            let mut changes = log.overlapping(Step(0), Step(step));
            changes.next().and_then(|change| change.ended_as_of(Step(step), QUIET))
        };
        assert_eq!((ended(&log, 170), ended(&log, 190)), (None, Some(Step(150))));
        // above its threshold once more before it was over
        log.prolong(0, Step(180), 2.0);
        assert_eq!(
            (ended(&log, 170), ended(&log, 190), ended(&log, 220)),
            (None, None, Some(Step(180)))
        );
    }

    #[test]
    fn an_end_is_reported_once() {
        let mut log = log();
        assert!(log.end(Step(189)).is_none());
        let ended = log.end(Step(190)).map(|(change, until)| (change.step, until));
        assert_eq!(ended, Some((Step(100), Step(150))));
        assert!(log.end(Step(191)).is_none());
    }

    #[test]
    fn what_goes_on_after_it_was_over_is_another_change() {
        let mut log = log();
        log.prolong(0, Step(300), 5.0);
        let steps: Vec<u64> = log.between(Step(0), Step(400)).map(|change| change.step.0).collect();
        assert_eq!(steps, [100, 300]);
    }

    #[test]
    fn what_shows_earlier_than_it_was_recalled_is_the_same_change() {
        let mut log = log();
        log.push(LoggedChange::new(0, Step(300), Step(300), 2.0));
        log.merge_repeat(0, Step(298), 2.0);
        (298..=310).for_each(|step| log.prolong(0, Step(step), 2.0));
        let steps: Vec<u64> = log.between(Step(0), Step(400)).map(|change| change.step.0).collect();
        assert_eq!(steps, [100, 300]);
        let mut ended = || log.end(Step(350)).map(|(_, until)| until);
        assert_eq!([ended(), ended()], [Some(Step(150)), Some(Step(310))]);
    }

    #[test]
    fn a_change_whose_end_was_known_before_a_restart_is_not_reported_again() {
        let change = |until: Option<u64>| vocabulary::Change {
            component: "sensor/g1".parse().unwrap(),
            onset: Step(95),
            step: Step(100),
            ratio: 2.0,
            until: until.map(Step),
        };
        let recalled = |until| {
            let mut log = ChangeLog::new(TIE, QUIET);
            log.recall([LoggedChange::recalled(0, &change(until), Step(120))]);
            log.end(Step(500)).map(|(_, until)| until)
        };
        assert_eq!((recalled(Some(110)), recalled(None)), (None, Some(Step(120))));
    }
}
