//! The first change names the fault and explains the later ones.
//!
//! Changes of the whole structure fall into groups. A group begins with a change that no earlier group
//! covers and lasts for the explanation horizon. Its root is the earliest change; changes within the
//! tie of it are simultaneous, and of those the largest D/γ wins. Every other change of the group is
//! explained by the root.
//!
//! A root by its ratio ends a group and begins another: a fault moves its own residual at once, but
//! its effects arrive by way of cylinders and masses and creep. A change whose D/γ reaches the root
//! ratio within the tie is a root cause of its own. Later changes of the root itself that reach it
//! (its repair, its fault leaving the interval) begin nothing: they would only make it explain for
//! longer.
//!
//! The verdict on a change at step a depends on nothing after step a + 2·tie: changes up to
//! a + tie may be its rivals, and their ratios are final a tie later. Every module that knows all
//! changes up to there reaches the same verdict.

use names::{ComponentPath, Step};

use super::judgement::Judgement;
use super::knowledge::KnownChange;
use crate::settings::IsolationSettings;

/// How changes are grouped: a group begins with a change that no earlier group covers and lasts for the
/// explanation horizon, or until a root by its ratio begins another (an extension of section 4.3 of the
/// paper).
#[derive(Debug, Clone, Copy)]
pub struct Groups {
    /// Steps that a group lasts after its first change.
    horizon: u64,
    /// Steps within which changes are simultaneous.
    tie: u64,
    /// D/γ from which on a change is a root by its ratio.
    root_ratio: f64,
}

/// The group that a change belongs to: the reason for the verdict on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Group<'a> {
    /// The change that explains all others of the group.
    pub root: &'a KnownChange,
    /// The step of its first change.
    pub first: Step,
    /// The changes that are simultaneous with the first, that one included; the root is among them.
    pub rivals: &'a [KnownChange],
    /// The last step that the group before it covers.
    pub before: Option<Step>,
}

impl Groups {
    /// Groups as a module's settings make them.
    #[must_use]
    pub fn new(settings: &IsolationSettings) -> Self {
        let IsolationSettings { horizon_steps, tie_steps, root_ratio, .. } = *settings;
        Self { horizon: horizon_steps, tie: tie_steps, root_ratio }
    }

    /// The group of the change of `component` at `step`. `changes` must be sorted by step and begin
    /// outside any group; `None` if the change is not among them.
    #[must_use]
    pub fn find<'a>(
        &self,
        changes: &'a [KnownChange],
        component: &ComponentPath,
        step: Step,
    ) -> Option<Group<'a>> {
        let (mut rest, mut before) = (changes, None);
        while let Some(first) = rest.first() {
            let end = self.end(rest, first);
            let (group, later) = rest.split_at(rest.partition_point(|c| c.step <= end));
            if group.iter().any(|c| c.step == step && c.path == *component) {
                let (root, rivals) = (self.root(group, first), self.rivals(group, first));
                return Some(Group { root, first: first.step, rivals, before });
            }
            (rest, before) = (later, Some(end));
        }
        None
    }

    /// Judges the change of `component` at `step`, which must be among `changes`; see [`Self::find`].
    pub(crate) fn judge(
        &self,
        changes: &[KnownChange],
        component: &ComponentPath,
        step: Step,
    ) -> Judgement {
        match self.find(changes, component, step) {
            Some(Group { root, .. }) if root.path != *component => {
                Judgement::Explained { by: root.path.clone(), since: root.step }
            }
            Some(_) | None => Judgement::Root,
        }
    }

    /// Drops the groups that are over by `known_until` from the front of `changes`; returns the last
    /// step that the dropped groups cover.
    pub(crate) fn drop_closed(
        &self,
        changes: &mut Vec<KnownChange>,
        known_until: Step,
    ) -> Option<Step> {
        let mut covered = None;
        while let Some(first) = changes.first() {
            let end = self.end(changes, first);
            if end > known_until {
                break;
            }
            changes.drain(..changes.partition_point(|c| c.step <= end));
            covered = Some(end);
        }
        covered
    }

    /// The last step that the group beginning with `first`, the first of `changes`, covers.
    fn end(&self, changes: &[KnownChange], first: &KnownChange) -> Step {
        let root = self.root(changes, first);
        let tie = first.step.plus(self.tie);
        let mut roots = changes.iter().filter(|c| c.step > tie && c.ratio >= self.root_ratio);
        let next = roots.find(|c| c.path != root.path);
        let horizon = first.step.plus(self.horizon);
        next.map_or(horizon, |next| horizon.min(next.step.minus(1)))
    }

    /// The root of the group beginning with `first`, the first of `changes`.
    fn root<'a>(&self, changes: &'a [KnownChange], first: &'a KnownChange) -> &'a KnownChange {
        let rivals = self.rivals(changes, first).iter();
        rivals.fold(first, |best, c| if c.outranks(best) { c } else { best })
    }

    /// Those of `changes` that are simultaneous with `first`, the first of them.
    fn rivals<'a>(&self, changes: &'a [KnownChange], first: &KnownChange) -> &'a [KnownChange] {
        let tie = first.step.plus(self.tie);
        &changes[..changes.partition_point(|c| c.step <= tie)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GROUPS: Groups = Groups { horizon: 100, tie: 3, root_ratio: 30.0 };

    fn change(path: &str, step: u64, ratio: f64) -> KnownChange {
        KnownChange { path: path.parse().unwrap(), step: Step(step), ratio }
    }

    fn judge(changes: &[KnownChange], index: usize) -> Option<String> {
        match GROUPS.judge(changes, &changes[index].path, changes[index].step) {
            Judgement::Root => None,
            Judgement::Explained { by, .. } => Some(by.to_string()),
        }
    }

    #[test]
    fn the_first_change_is_the_root_and_explains_the_later_ones_wherever_they_are() {
        let changes = [
            change("m1/sensor/g1", 50, 1.1),
            change("m2/actuator/a1", 58, 29.0),
            change("m2/sensor/g1", 150, 9.0),
        ];
        assert_eq!(judge(&changes, 0), None);
        assert_eq!(judge(&changes, 1).as_deref(), Some("m1/sensor/g1"));
        assert_eq!(judge(&changes, 2).as_deref(), Some("m1/sensor/g1"));
    }

    #[test]
    fn of_simultaneous_changes_the_largest_ratio_wins() {
        let changes = [change("m1/sensor/g1", 50, 1.1), change("m1/actuator/a1", 53, 7.0)];
        assert_eq!(judge(&changes, 0).as_deref(), Some("m1/actuator/a1"));
        assert_eq!(judge(&changes, 1), None);
    }

    #[test]
    fn a_change_after_the_horizon_begins_a_new_group_even_if_the_old_one_is_still_active() {
        let changes = [
            change("m1/sensor/g1", 50, 2.0),
            change("m1/sensor/g2", 150, 2.0),
            change("m1/sensor/g3", 151, 2.0),
            change("m1/sensor/g4", 200, 2.0),
        ];
        assert_eq!(judge(&changes, 1).as_deref(), Some("m1/sensor/g1"));
        assert_eq!(judge(&changes, 2), None);
        assert_eq!(judge(&changes, 3).as_deref(), Some("m1/sensor/g3"));
    }

    #[test]
    fn the_reason_for_a_verdict_is_the_group_of_the_change() {
        let changes = [
            change("m1/sensor/g1", 50, 2.0),
            change("m1/sensor/g2", 151, 2.0),
            change("m1/sensor/g3", 154, 9.0),
            change("m1/sensor/g4", 200, 2.0),
        ];
        let reason =
            |at: usize| GROUPS.find(&changes, &changes[at].path, changes[at].step).unwrap();
        let (first, rivals) = (Step(50), &changes[..1]);
        assert_eq!(reason(0), Group { root: &changes[0], first, rivals, before: None });
        let (first, rivals, before) = (Step(151), &changes[1..3], Some(Step(150)));
        assert_eq!(reason(3), Group { root: &changes[2], first, rivals, before });
        assert_eq!(GROUPS.find(&changes, &changes[0].path, Step(51)), None);
    }

    #[test]
    fn a_root_by_its_ratio_is_no_effect_and_explains_what_follows_it() {
        let changes = [
            change("m1/sensor/g1", 50, 1.1),
            change("m1/sensor/g2", 60, 2.0),
            change("m1/sensor/g3", 70, 2.0),
            change("m2/sensor/g1", 70, 500.0),
            change("m1/sensor/g2", 80, 2.0),
            change("m1/sensor/g2", 165, 2.0),
            change("m1/sensor/g2", 171, 2.0),
        ];
        assert_eq!(judge(&changes, 1).as_deref(), Some("m1/sensor/g1"));
        // in the same step as the root by its ratio, and beyond the horizon of the first group
        for index in [2, 4, 5] {
            assert_eq!(judge(&changes, index).as_deref(), Some("m2/sensor/g1"));
        }
        assert_eq!((judge(&changes, 3), judge(&changes, 6)), (None, None));
        let mut kept = changes.to_vec();
        assert_eq!(GROUPS.drop_closed(&mut kept, Step(100)), Some(Step(69)));
        assert_eq!(kept, changes[2..]);
    }

    #[test]
    fn the_root_itself_reaching_the_root_ratio_again_begins_nothing() {
        let changes = [
            change("m1/sensor/g1", 50, 500.0),
            change("m1/sensor/g1", 90, 500.0),
            change("m1/sensor/g2", 140, 2.0),
            change("m1/sensor/g2", 151, 2.0),
        ];
        assert_eq!(judge(&changes, 2).as_deref(), Some("m1/sensor/g1"));
        assert_eq!(judge(&changes, 3), None);
    }

    #[test]
    fn dropping_closed_groups_changes_no_verdict() {
        let all = [
            change("m1/sensor/g1", 50, 2.0),
            change("m1/sensor/g2", 120, 2.0),
            change("m1/sensor/g3", 151, 2.0),
            change("m1/sensor/g4", 200, 2.0),
        ];
        let mut kept = all.to_vec();
        assert_eq!(GROUPS.drop_closed(&mut kept, Step(149)), None);
        assert_eq!(GROUPS.drop_closed(&mut kept, Step(150)), Some(Step(150)));
        assert_eq!(kept, all[2..]);
        assert_eq!(judge(&kept, 1), judge(&all, 3));
    }

    #[test]
    fn the_order_in_which_modules_are_named_does_not_matter() {
        // exact draws fall to the earlier change, then to the smaller name
        let draw = [change("m1/sensor/g1", 50, 5.0), change("m2/sensor/g1", 50, 5.0)];
        let swapped = [draw[1].clone(), draw[0].clone()];
        assert_eq!(judge(&draw, 0), None);
        assert_eq!(judge(&swapped, 1), None);
    }
}
