//! What was held of each component at each step of an undisturbed run.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::RangeInclusive;

use vocabulary::{ComponentPath, Step};

use crate::held::Held;

/// The transitions of a run, by component, in the order of steps.
#[derive(Debug, Clone, Default)]
pub struct Timeline {
    transitions: BTreeMap<ComponentPath, Vec<(Step, Held)>>,
}

impl Timeline {
    /// Adds the next transition of a component.
    pub fn note(&mut self, component: ComponentPath, decided: Step, held: Held) {
        self.transitions.entry(component).or_default().push((decided, held));
    }

    /// What was held of a component at any of these steps.
    #[must_use]
    pub fn held(&self, component: &ComponentPath, steps: RangeInclusive<Step>) -> BTreeSet<Held> {
        let transitions = self.transitions.get(component).map_or(&[][..], Vec::as_slice);
        let before = transitions.iter().rev().find(|(step, _)| step <= steps.start());
        let mut held = BTreeSet::from([before.map_or(Held::Normal, |(_, held)| held.clone())]);
        let within = transitions.iter().filter(|(step, _)| steps.contains(step));
        held.extend(within.map(|(_, held)| held.clone()));
        held
    }

    /// Was this ever held of the component?
    #[must_use]
    pub fn ever(&self, component: &ComponentPath, held: &Held) -> bool {
        let transitions = self.transitions.get(component);
        transitions.is_some_and(|all| all.iter().any(|(_, other)| other == held))
    }

    /// The verdicts that were reached up to a step.
    pub fn verdicts_until(&self, last: Step) -> impl Iterator<Item = (&ComponentPath, &Held)> {
        let verdicts = self.transitions.iter().flat_map(move |(component, all)| {
            let until = all.iter().filter(move |(step, _)| *step <= last);
            until.map(move |(_, held)| (component, held))
        });
        verdicts.filter(|(_, held)| matches!(held, Held::Latched | Held::Explained(_)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timeline() -> (Timeline, ComponentPath) {
        let component: ComponentPath = "module1/sensor/g1".parse().unwrap();
        let mut timeline = Timeline::default();
        for (step, held) in [(10, Held::Tentative), (16, Held::Explained(None)), (90, Held::Normal)]
        {
            timeline.note(component.clone(), Step(step), held);
        }
        (timeline, component)
    }

    #[test]
    fn a_component_is_normal_until_its_first_transition() {
        let (timeline, component) = timeline();
        let held = |from, to| timeline.held(&component, Step(from)..=Step(to));
        assert_eq!(held(0, 9), BTreeSet::from([Held::Normal]));
        assert_eq!(held(9, 10), BTreeSet::from([Held::Normal, Held::Tentative]));
        assert_eq!(held(20, 50), BTreeSet::from([Held::Explained(None)]));
        assert_eq!(held(1000, 1000), BTreeSet::from([Held::Normal]));
        let other = "module1/sensor/g2".parse().unwrap();
        assert_eq!(timeline.held(&other, Step(0)..=Step(99)), BTreeSet::from([Held::Normal]));
    }

    #[test]
    fn what_passed_was_held_once() {
        let (timeline, component) = timeline();
        assert!(timeline.ever(&component, &Held::Explained(None)));
        assert!(!timeline.ever(&component, &Held::Latched));
        let verdicts: Vec<_> = timeline.verdicts_until(Step(16)).collect();
        assert_eq!(verdicts, [(&component, &Held::Explained(None))]);
        assert_eq!(timeline.verdicts_until(Step(15)).count(), 0);
    }
}
