//! The first change names the fault and explains the later ones.
//!
//! Changes of the whole structure are taken in their order. One that no root cause explains is itself the root
//! cause; changes within the tie of it are simultaneous, and of those the largest D/γ wins. A root cause
//! explains what begins to change while it changes itself, and for an effect time afterwards: a fault moves its
//! own residual at once, but its effects arrive by way of cylinders and masses.
//!
//! - A change whose D/γ reaches the root ratio within the tie is a separate root cause rather than an effect.
//! - A component that was a root cause is one again whenever it changes before the interval has forgotten it, or
//!   as long as it is known to be faulty: it is repaired, it is back, or its fault leaves the interval. It explains
//!   what follows from that, too.
//! - A root cause that comes and goes explains for as long as the interval remembers, for the Gaussian learns it.
//!   More changes than an onset, a repair and their leaving are coming and going.
//! - An effect leaves the interval as it entered it: with the same explanation. What begins to change while a root
//!   cause's change leaves the interval is explained by it too, for it may have been too small to show before. What was
//!   taken for that may have been something else, and leaves in its turn; that is where it ends.
//! - An effect may be another fault that hides behind the root cause, as may what leaves the interval. What begins
//!   while it changes, and for an effect time afterwards, is explained by the same root cause; that is where it ends.
//!
//! The verdict on a change at step a depends on nothing after step a + 2·tie: changes up to a + tie may be its
//! rivals, and their ratios are final a tie later. Every module that knows all changes up to there reaches the
//! same verdict.

use vocabulary::{ComponentPath, Step};

use super::case::Judgement;
use super::causes::{Causes, Reason};
use super::knowledge::KnownChange;
use super::windows::Windows;
use crate::divergence::DivergenceSettings;
use crate::settings::IsolationSettings;

/// The rule by which changes are judged (an extension of section 4.3 of the paper).
#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
pub struct FirstChange(Windows);

impl FirstChange {
    /// The rule as a module's settings make it.
    #[must_use]
    pub fn new(isolation: &IsolationSettings, divergence: &DivergenceSettings) -> Self {
        Self(Windows::new(isolation, divergence))
    }

    /// Why the change of `component` at `step` is a root cause or not. `changes` must be all of the structure,
    /// sorted by step; `None` if the change is not among them.
    #[must_use]
    pub fn reason(
        &self,
        changes: &[KnownChange],
        component: &ComponentPath,
        step: Step,
    ) -> Option<Reason> {
        self.reason_after(&Causes::default(), changes, component, step)
    }

    fn reason_after(
        &self,
        causes: &Causes,
        mut changes: &[KnownChange],
        component: &ComponentPath,
        step: Step,
    ) -> Option<Reason> {
        let mut causes = causes.clone();
        while !changes.is_empty() {
            let reasons = causes.take(&self.0, changes);
            let (taken, rest) = changes.split_at(reasons.len());
            let wanted = |change: &&KnownChange| change.step == step && change.path == *component;
            if let Some(place) = taken.iter().position(|change| wanted(&change)) {
                return reasons.into_iter().nth(place);
            }
            changes = rest;
        }
        None
    }

    /// How long changes bear on each other.
    pub(super) fn windows(&self) -> &Windows {
        &self.0
    }

    /// Judges the change of `component` at `step`, which must be among the `changes` that follow those that
    /// the causes hold.
    pub(crate) fn judge(
        &self,
        causes: &Causes,
        changes: &[KnownChange],
        component: &ComponentPath,
        step: Step,
    ) -> Judgement {
        match self.reason_after(causes, changes, component, step) {
            Some(Reason::Effect { by, since, .. }) => Judgement::Explained { by, since },
            Some(Reason::Again) => Judgement::Again,
            Some(Reason::First { rivals, .. }) => {
                let own = rivals.iter().find(|c| c.path == *component && c.step == step);
                let jumps = own.is_some_and(|change| self.0.is_root_by_ratio(change));
                if jumps { Judgement::Root } else { Judgement::First }
            }
            Some(Reason::ByRatio) | None => Judgement::Root,
        }
    }

    /// Judges the first of `changes` and all that are judged with it, for good: one reason for each, in their
    /// order.
    pub(crate) fn take(&self, causes: &mut Causes, changes: &[KnownChange]) -> Vec<Reason> {
        causes.take(&self.0, changes)
    }
}

#[cfg(test)]
mod tests {
    use super::super::causes::Explanation;
    use super::*;

    const RULE: FirstChange = FirstChange(Windows {
        tie: 3,
        effects: 100,
        spread: 20,
        root_ratio: 30.0,
        leaving: Some((900, 1120)),
    });

    /// A change that goes on for ten steps.
    fn change(path: &str, step: u64, ratio: f64) -> KnownChange {
        let until = Some(Step(step + 10));
        let (path, step) = (path.parse().unwrap(), Step(step));
        KnownChange { path, onset: step, step, ratio, until }
    }

    fn judge(changes: &[KnownChange], index: usize) -> Option<String> {
        let KnownChange { path, step, .. } = &changes[index];
        match RULE.judge(&Causes::default(), changes, path, *step) {
            Judgement::Root | Judgement::First | Judgement::Again => None,
            Judgement::Explained { by, .. } => Some(by.to_string()),
        }
    }

    fn judge_all(changes: &[KnownChange]) -> Vec<Option<String>> {
        (0..changes.len()).map(|index| judge(changes, index)).collect()
    }

    #[test]
    fn the_first_change_is_the_root_and_explains_the_later_ones_wherever_they_are() {
        let changes = [
            change("m1/sensor/g1", 50, 1.1),
            change("m2/actuator/a1", 58, 29.0),
            change("m2/sensor/g1", 160, 9.0),
        ];
        let root = || Some("m1/sensor/g1".to_owned());
        assert_eq!(judge_all(&changes), [None, root(), root()]);
    }

    #[test]
    fn of_simultaneous_changes_the_largest_ratio_wins() {
        let changes = [change("m1/sensor/g1", 50, 1.1), change("m1/actuator/a1", 53, 7.0)];
        assert_eq!(judge(&changes, 0).as_deref(), Some("m1/actuator/a1"));
        assert_eq!(judge(&changes, 1), None);
    }

    #[test]
    fn after_the_effect_time_a_change_is_a_root_of_its_own() {
        for (step, root) in [(160, Some("m1/sensor/g1")), (161, None)] {
            let changes = [change("m1/sensor/g1", 50, 2.0), change("m1/sensor/g2", step, 2.0)];
            assert_eq!(judge(&changes, 1).as_deref(), root, "{step}");
        }
    }

    #[test]
    fn a_fault_hidden_behind_a_root_has_effects_too() {
        let mut changes = vec![
            change("m1/sensor/g1", 50, 2.0),
            change("m1/sensor/g2", 160, 2.0),
            change("m1/sensor/g3", 270, 2.0),
        ];
        assert_eq!(judge(&changes, 2).as_deref(), Some("m1/sensor/g1"));
        changes.push(change("m1/sensor/g4", 271, 2.0));
        changes[2].step = Step(269);
        assert_eq!(judge(&changes, 3), None, "the effect of an effect has none");
    }

    #[test]
    fn while_a_root_goes_on_changing_it_explains() {
        let mut changes = [change("m1/sensor/g1", 50, 2.0), change("m1/sensor/g2", 800, 2.0)];
        assert_eq!(judge(&changes, 1), None);
        changes[0].until = None;
        assert_eq!(judge(&changes, 1).as_deref(), Some("m1/sensor/g1"));
        changes[0].until = Some(Step(700));
        assert_eq!(judge(&changes, 1).as_deref(), Some("m1/sensor/g1"));
    }

    #[test]
    fn what_began_while_a_root_explained_is_its_effect_however_late_it_shows() {
        let mut changes = [change("m1/sensor/g1", 50, 2.0), change("m1/sensor/g2", 300, 2.0)];
        assert_eq!(judge(&changes, 1), None);
        changes[1].onset = Step(160);
        assert_eq!(judge(&changes, 1).as_deref(), Some("m1/sensor/g1"));
    }

    #[test]
    fn a_repair_has_effects_too() {
        let changes = [
            change("m1/sensor/g1", 50, 500.0),
            change("m1/sensor/g1", 700, 500.0),
            change("m1/sensor/g2", 720, 40.0),
            change("m1/sensor/g3", 800, 2.0),
            change("m1/sensor/g4", 911, 2.0),
        ];
        let found = judge_all(&changes);
        // 40 times its threshold, 20 steps later: that is no effect
        assert_eq!((&found[1], &found[2]), (&None, &None));
        assert_eq!(found[3].as_deref(), Some("m1/sensor/g2"));
        assert_eq!(found[4], None);
        let without = [changes[0].clone(), changes[1].clone(), changes[3].clone()];
        assert_eq!(judge(&without, 2).as_deref(), Some("m1/sensor/g1"));
    }

    #[test]
    fn a_root_of_before_shows_effects_of_a_later_root() {
        let faults = [change("m1/sensor/g1", 50, 500.0), change("m1/sensor/g2", 700, 500.0)];
        let with = |own: KnownChange, later| {
            let changes = [&faults[..], &[own, change("m1/sensor/g3", later, 2.0)]].concat();
            [2, 3].map(|index| judge(&changes, index))
        };
        let by_later = || Some("m1/sensor/g2".to_owned());
        assert_eq!(with(change("m1/sensor/g1", 725, 9.0), 740), [by_later(), by_later()]);
        // Repaired, or faulty again.
        let again = change("m1/sensor/g1", 725, 40.0);
        assert_eq!(with(again, 740), [None, Some("m1/sensor/g1".to_owned())]);
        // The later root explains nothing any more.
        assert_eq!(with(change("m1/sensor/g1", 811, 9.0), 1030)[0], None);
        // The same when they are simultaneous, whichever shows first.
        for step in [698, 702] {
            let mut changes = [&faults[..], &[change("m1/sensor/g1", step, 9.0)]].concat();
            changes.sort_by_key(|change| change.step);
            let own = changes.iter().position(|change| change.step == Step(step)).unwrap();
            assert_eq!(judge(&changes, own), by_later(), "{step}");
        }
    }

    #[test]
    fn a_root_of_before_wins_a_tie_unless_another_has_the_ratio_of_a_root() {
        let with = |ratio| {
            [
                change("m1/sensor/g1", 50, 9.0),
                change("m1/sensor/g2", 700, ratio),
                change("m1/sensor/g1", 702, 9.0),
            ]
        };
        assert_eq!(judge(&with(20.0), 1).as_deref(), Some("m1/sensor/g1"));
        assert_eq!(judge(&with(31.0), 1), None);
    }

    #[test]
    fn an_effect_leaves_the_interval_with_the_explanation_that_it_entered_with() {
        let entering = [change("m1/sensor/g1", 50, 500.0), change("m1/sensor/g2", 90, 8.0)];
        let found = |leaving: KnownChange| judge(&[&entering[..], &[leaving]].concat(), 2);
        assert_eq!(found(change("m1/sensor/g2", 1090, 9.0)).as_deref(), Some("m1/sensor/g1"));
        // too early, too late, too large
        for (step, ratio) in [(949, 9.0), (1230, 9.0), (1090, 31.0)] {
            assert_eq!(found(change("m1/sensor/g2", step, ratio)), None, "{step} {ratio}");
        }
    }

    #[test]
    fn what_was_too_small_to_show_leaves_the_interval_too() {
        let found =
            |step| judge(&[change("m1/sensor/g1", 50, 20.0), change("m1/sensor/g2", step, 1.1)], 1);
        for step in [950, 1180] {
            assert_eq!(found(step).as_deref(), Some("m1/sensor/g1"), "{step}");
        }
        for step in [949, 1181] {
            assert_eq!(found(step), None, "{step}");
        }
    }

    #[test]
    fn a_root_by_its_ratio_is_no_effect_and_explains_what_follows_it() {
        let changes = [
            change("m1/sensor/g1", 50, 1.1),
            change("m1/sensor/g2", 60, 2.0),
            change("m1/sensor/g3", 70, 2.0),
            change("m2/sensor/g1", 71, 500.0),
            change("m1/sensor/g4", 80, 2.0),
            change("m1/sensor/g5", 181, 2.0),
            change("m1/sensor/g6", 292, 2.0),
        ];
        let found = judge_all(&changes);
        for index in [1, 2] {
            assert_eq!(found[index].as_deref(), Some("m1/sensor/g1"));
        }
        for index in [4, 5] {
            assert_eq!(found[index].as_deref(), Some("m2/sensor/g1"));
        }
        assert_eq!((&found[3], &found[6]), (&None, &None));
    }

    /// The root cause is forgotten, its effect leaves the interval, and that shows in the root's channel.
    #[test]
    fn an_echo_of_its_own_effect_makes_nothing_a_root_by_its_ratio() {
        let changes = [
            change("m1/sensor/g1", 50, 1.3),
            change("m2/actuator/a1", 150, 9.0),
            change("m2/actuator/a1", 1200, 1.4),
            change("m1/sensor/g1", 1210, 1.2),
        ];
        let root = || Some("m1/sensor/g1".to_owned());
        assert_eq!(judge_all(&changes), [None, root(), root(), None]);
        let KnownChange { path, step, .. } = &changes[3];
        let judgement = RULE.judge(&Causes::default(), &changes, path, *step);
        assert_eq!(judgement, Judgement::Again);
    }

    #[test]
    fn what_has_left_the_interval_leaves_it_once() {
        let changes = [
            change("m1/sensor/g1", 50, 20.0),
            change("m1/sensor/g1", 1060, 20.0),
            change("m1/sensor/g2", 2060, 2.0),
        ];
        assert_eq!(judge_all(&changes), [None, None, None]);
    }

    #[test]
    fn what_may_have_grown_in_a_gap_is_no_jump() {
        let mut changes = [change("m1/sensor/g1", 50, 2.0), change("m1/sensor/g2", 150, 500.0)];
        assert_eq!(judge(&changes, 1), None);
        changes[1].onset = Step(120);
        assert_eq!(judge(&changes, 1).as_deref(), Some("m1/sensor/g1"));
    }

    #[test]
    fn a_root_that_comes_and_goes_explains_as_long_as_the_interval_remembers() {
        let mut changes: Vec<_> =
            (0..4).map(|k| change("m1/sensor/g1", 50 + 200 * k, 2.0)).collect();
        changes.push(change("m1/sensor/g2", 900, 2.0));
        assert_eq!(judge(&changes, 4).as_deref(), Some("m1/sensor/g1"));
        assert_eq!(judge(&changes[1..], 3), None, "three changes are not enough");
    }

    #[test]
    fn the_reason_is_given_with_the_verdict() {
        let changes = [
            change("m1/sensor/g1", 50, 2.0),
            change("m1/sensor/g2", 170, 2.0),
            change("m1/sensor/g3", 173, 9.0),
            change("m1/sensor/g1", 300, 9.0),
            change("m1/sensor/g4", 310, 90.0),
        ];
        let reason = |at: usize| RULE.reason(&changes, &changes[at].path, changes[at].step);
        let first = |rivals: &[KnownChange], before: Option<u64>| {
            Some(Reason::First { rivals: rivals.to_vec(), before: before.map(Step) })
        };
        assert_eq!(reason(0), first(&changes[..1], None));
        let tie = Explanation::Tie;
        let by = changes[2].path.clone();
        assert_eq!(reason(1), Some(Reason::Effect { by, since: Step(173), how: tie }));
        assert_eq!(reason(2), first(&changes[1..3], Some(160)));
        assert_eq!((reason(3), reason(4)), (Some(Reason::Again), Some(Reason::ByRatio)));
        assert_eq!(RULE.reason(&changes, &changes[0].path, Step(51)), None);
    }

    #[test]
    fn what_was_taken_before_changes_no_verdict() {
        let all = [
            change("m1/sensor/g1", 50, 2.0),
            change("m1/sensor/g2", 120, 2.0),
            change("m1/sensor/g3", 171, 2.0),
            change("m1/sensor/g1", 400, 2.0),
            change("m1/sensor/g4", 450, 2.0),
            change("m1/sensor/g2", 1130, 2.0),
        ];
        let (mut causes, mut taken) = (Causes::default(), 0);
        while taken < all.len() {
            for (change, index) in all[taken..].iter().zip(taken..) {
                let found = RULE.judge(&causes, &all[taken..], &change.path, change.step);
                let found = match found {
                    Judgement::Root | Judgement::First | Judgement::Again => None,
                    Judgement::Explained { by, .. } => Some(by.to_string()),
                };
                assert_eq!(found, judge(&all, index), "{change:?}, {taken} taken");
            }
            taken += RULE.take(&mut causes, &all[taken..]).len();
        }
    }

    #[test]
    fn nothing_is_explained_by_itself() {
        // twice within the tie, of which the second outranks the first
        let changes = [change("m1/sensor/g1", 50, 2.0), change("m1/sensor/g1", 52, 9.0)];
        assert_eq!(judge_all(&changes), [None, None]);
        // by an effect that goes on after the interval has forgotten what it is an effect of
        let mut changes = [
            change("m1/sensor/g1", 50, 9.0),
            change("m1/sensor/g2", 100, 2.0),
            change("m1/sensor/g1", 1300, 9.0),
            change("m1/sensor/g3", 1310, 2.0),
        ];
        changes[1].until = None;
        let root = || Some("m1/sensor/g1".to_owned());
        assert_eq!(judge_all(&changes), [None, root(), None, root()]);
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
