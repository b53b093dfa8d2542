//! The first change names the fault and explains the later ones.
//!
//! Changes of the whole structure fall into groups. A group begins with a change that no earlier group
//! covers and lasts for the explanation horizon. Its root is the earliest change; changes within the
//! tie of it are simultaneous, and of those the largest D/γ wins. Every other change of the group is
//! explained by the root.
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
            let length = self.length(rest, first.step);
            let (group, later) = rest.split_at(length);
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
            let end = first.step.plus(self.horizon);
            if end > known_until {
                break;
            }
            let length = self.length(changes, first.step);
            changes.drain(..length);
            covered = Some(end);
        }
        covered
    }

    fn length(&self, changes: &[KnownChange], first: Step) -> usize {
        changes.partition_point(|c| c.step <= first.plus(self.horizon))
    }

    fn judge_within(
        &self,
        group: &[KnownChange],
        first: &KnownChange,
        component: &ComponentPath,
    ) -> Judgement {
        let rivals = group.iter().take_while(|c| c.step <= first.step.plus(self.tie));
        let root = rivals.fold(first, |best, c| if c.outdoes(best) { c } else { best });
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

    const GROUPS: Groups = Groups { horizon: 100, tie: 3 };

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
            change("m2/actuator/a1", 58, 900.0),
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
