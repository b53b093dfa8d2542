//! The first change names the fault and explains the later ones.
//!
//! Changes of the whole structure fall into groups. A group begins with a change that no earlier group
//! covers and lasts for the explanation horizon. Its root is the earliest change; changes within the
//! tie of it are simultaneous, and of those the largest D/γ wins. Every other change of the group is
//! explained by the root.
//!
//! A leap ends a group and begins another: a fault moves its own residual at once, but its effects come
//! by way of cylinders and masses and creep. A change that rises within the tie to many times its
//! threshold is nobody's effect. The root's own later leaps (its repair, its fault leaving the interval)
//! begin nothing: they would only make it explain for longer.
//!
//! The verdict on a change at step a depends on nothing after step a + 2·tie: changes up to
//! a + tie may be its rivals, and their ratios are final a tie later. Whoever knows all changes up to
//! there comes to the same verdict.

use truss::ids::{ComponentPath, Step};

use super::{Judgement, KnownChange};

/// How changes are grouped.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Groups {
    /// Steps that a group lasts after its first change.
    pub(crate) horizon: u64,
    /// Steps within which changes are simultaneous.
    pub(crate) tie: u64,
    /// D/γ from which on a change is a leap.
    pub(crate) leap: f64,
}

impl Groups {
    /// Judges the change of `component` at `step`. `changes` must hold it, be sorted by step, and
    /// begin outside any group.
    pub(crate) fn judge(
        &self,
        changes: &[KnownChange],
        component: &ComponentPath,
        step: Step,
    ) -> Judgement {
        let mut rest = changes;
        while let Some(first) = rest.first() {
            let end = self.end(rest, first);
            let (group, later) = rest.split_at(rest.partition_point(|c| c.step <= end));
            if group.iter().any(|c| c.step == step && c.path == *component) {
                return self.judge_within(group, first, component);
            }
            rest = later;
        }
        Judgement::Root
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
        let mut leaps = changes.iter().filter(|c| c.step > tie && c.ratio >= self.leap);
        let leap = leaps.find(|c| c.path != root.path);
        let horizon = first.step.plus(self.horizon);
        leap.map_or(horizon, |leap| horizon.min(leap.step.minus(1)))
    }

    /// The root of the group beginning with `first`, the first of `changes`.
    fn root<'a>(&self, changes: &'a [KnownChange], first: &'a KnownChange) -> &'a KnownChange {
        let rivals = changes.iter().take_while(|c| c.step <= first.step.plus(self.tie));
        rivals.fold(first, |best, c| if c.outdoes(best) { c } else { best })
    }

    fn judge_within(
        &self,
        group: &[KnownChange],
        first: &KnownChange,
        component: &ComponentPath,
    ) -> Judgement {
        let root = self.root(group, first);
        if root.path == *component {
            Judgement::Root
        } else {
            Judgement::Explained { by: root.path.clone(), since: root.step }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GROUPS: Groups = Groups { horizon: 100, tie: 3, leap: 30.0 };

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
    fn a_leap_is_nobody_s_effect_and_explains_what_follows_it() {
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
        // in the very step of the leap, and beyond the horizon of the first group
        for index in [2, 4, 5] {
            assert_eq!(judge(&changes, index).as_deref(), Some("m2/sensor/g1"));
        }
        assert_eq!((judge(&changes, 3), judge(&changes, 6)), (None, None));
        let mut kept = changes.to_vec();
        assert_eq!(GROUPS.drop_closed(&mut kept, Step(100)), Some(Step(69)));
        assert_eq!(kept, changes[2..]);
    }

    #[test]
    fn a_leap_of_the_root_itself_begins_nothing() {
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
