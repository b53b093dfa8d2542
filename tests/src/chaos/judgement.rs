//! One component's state held against the undisturbed run.

use std::collections::BTreeSet;
use std::ops::RangeInclusive;

use vocabulary::{ComponentPath, Doubt, FaultTransition, Step};

use crate::held::Held;
use crate::timeline::Timeline;

/// A component's state as a module gave it.
#[derive(Debug, Clone)]
pub(super) struct Seen {
    pub(super) component: ComponentPath,
    pub(super) held: Held,
    /// If undecided: whether a reason is given, and which module is silent.
    pub(super) reasoned: bool,
}

impl Seen {
    pub(super) fn of_message(message: &FaultTransition) -> Self {
        Self {
            component: message.component.clone(),
            held: Held::of_message(message),
            reasoned: match message.verdict.doubt() {
                Some(Doubt::Silent(modules) | Doubt::Unknowing(modules)) => !modules.is_empty(),
                Some(Doubt::OneOf(components)) => !components.is_empty(),
                Some(Doubt::Assumed(_) | Doubt::RunEnded) => true,
                None => false,
            },
        }
    }
}

/// Judgement of a state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Judgement {
    /// As in the undisturbed run.
    Agrees,
    /// The module reports that it cannot decide, with the reason.
    Undecided,
    /// Not what the undisturbed run has by then, but what it has earlier or later, or nothing yet.
    Behind,
    /// Never true.
    Wrong(String),
}

/// Judges a state that a module reported while it was at one of these steps. What was
/// latched in an earlier run stays so.
pub(super) fn judge(
    seen: &Seen,
    steps: RangeInclusive<Step>,
    timeline: &Timeline,
    carried: &BTreeSet<ComponentPath>,
) -> Judgement {
    let Seen { component, held, reasoned } = seen;
    let expected = match carried.contains(component) {
        true => BTreeSet::from([Held::Latched]),
        false => timeline.held(component, steps),
    };
    if expected.contains(held) {
        return Judgement::Agrees;
    }
    match held {
        Held::Unconfirmed if !reasoned => {
            Judgement::Wrong(format!("{component} unconfirmed without a reason"))
        }
        Held::Unconfirmed => Judgement::Undecided,
        Held::Latched | Held::Explained(_) if !timeline.ever(component, held) => {
            Judgement::Wrong(format!("{component} {held}"))
        }
        // The verdict is right; that the change is over is a matter of milliseconds.
        Held::Explained(_) if expected == BTreeSet::from([Held::Normal]) => Judgement::Agrees,
        _ => Judgement::Behind,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(text: &str) -> ComponentPath {
        text.parse().unwrap()
    }

    fn timeline() -> Timeline {
        let mut timeline = Timeline::default();
        let mut note = |component, step, held| timeline.note(path(component), Step(step), held);
        note("module2/sensor/g1", 100, Held::Latched);
        note("module1/sensor/g3", 110, Held::Explained(Some(path("module2/sensor/g1"))));
        note("module1/sensor/g3", 160, Held::Normal);
        timeline
    }

    fn judged(component: &str, held: Held, step: u64) -> Judgement {
        let seen = Seen { component: path(component), held, reasoned: true };
        judge(&seen, Step(step)..=Step(step), &timeline(), &BTreeSet::new())
    }

    #[test]
    fn what_the_undisturbed_run_has_agrees_and_what_it_has_not_yet_is_behind() {
        let by_root = Held::Explained(Some(path("module2/sensor/g1")));
        assert_eq!(judged("module2/sensor/g1", Held::Latched, 120), Judgement::Agrees);
        assert_eq!(judged("module2/sensor/g1", Held::Normal, 120), Judgement::Behind);
        assert_eq!(judged("module1/sensor/g3", Held::Normal, 120), Judgement::Behind);
        assert_eq!(judged("module1/sensor/g3", by_root.clone(), 120), Judgement::Agrees);
        assert_eq!(judged("module1/sensor/g3", by_root, 200), Judgement::Agrees);
        assert_eq!(judged("module1/sensor/g3", Held::Unconfirmed, 120), Judgement::Undecided);
    }

    #[test]
    fn an_effect_that_is_latched_or_explained_by_another_is_wrong() {
        let by_other = Held::Explained(Some(path("module1/sensor/g9")));
        for held in [Held::Latched, by_other] {
            let judgement = judged("module1/sensor/g3", held, 120);
            assert!(matches!(judgement, Judgement::Wrong(_)), "{judgement:?}");
        }
    }

    #[test]
    fn what_was_latched_in_an_earlier_run_stays_so() {
        let component = path("module2/sensor/g1");
        let seen = |held| Seen { component: component.clone(), held, reasoned: false };
        let carried = BTreeSet::from([component.clone()]);
        let judged = |held| judge(&seen(held), Step(3)..=Step(3), &timeline(), &carried);
        assert_eq!(judged(Held::Latched), Judgement::Agrees);
        assert_eq!(judged(Held::Normal), Judgement::Behind);
    }
}
