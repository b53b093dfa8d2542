//! Which rows there are, the most urgent first.

use std::cmp::Reverse;

use observer::{LiveModule, Scene, Urgency};
use wire::{FaultState, FaultTransition};
use wording::{Tone, aside, identified, reason, state_in_words};

use super::filter::Filter;
use super::standing::Standing;
use super::subject::{Subject, Whose};

/// A row of the list of what needs attention.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Row {
    /// A module that cannot be relied on, with all its components of which nothing is known for that reason.
    Module(Whose),
    /// A component.
    Component(Subject),
}

/// What needs attention or is not normal. Of a module in `scope`, every component; with a filter, whatever it admits.
pub(crate) fn rows(scene: &Scene, filter: &Filter, scope: Option<&Whose>) -> Vec<Row> {
    let in_scope = |module: &&LiveModule| scope.is_none_or(|scope| Whose::of(module) == *scope);
    let mut ranked = Vec::new();
    for module in scene.modules.iter().filter(in_scope) {
        let standing = Standing::of(module);
        if !standing.is_reliable() && filter.admits(&module_text(module, standing)) {
            let rank = if standing.tone() == Tone::Alarm { 1 } else { 2 * Urgency::Unknown as u8 };
            ranked.push((rank, Reverse(u64::MAX), Row::Module(Whose::of(module))));
        }
        for component in &module.picture.components {
            let is_wanted = if scope.is_some() {
                true
            } else if filter.is_empty() {
                counts(component, standing)
            } else {
                Urgency::of(component) != Urgency::Normal
            };
            if is_wanted && filter.admits(&component_text(component)) {
                let rank = 2 * Urgency::of(component) as u8;
                let row = Row::Component(Subject::of(component));
                ranked.push((rank, Reverse(component.time_unix_ns), row));
            }
        }
    }
    // Stable: those of one time stay in the order of their names.
    ranked.sort_by_key(|(rank, time, _)| (*rank, *time));
    ranked.into_iter().map(|(_, _, row)| row).collect()
}

/// The row of its module stands for what is unknown because of it.
fn counts(component: &FaultTransition, standing: Standing) -> bool {
    match component.state() {
        FaultState::Normal => false,
        FaultState::Unknown => standing.is_reliable() || component.unknown.is_none(),
        _ => true,
    }
}

/// The modules.
pub(crate) fn modules(scene: &Scene) -> Vec<Whose> {
    scene.modules.iter().map(Whose::of).collect()
}

fn module_text(module: &LiveModule, standing: Standing) -> String {
    let Whose { structure, module } = Whose::of(module);
    let structure = structure.map_or_else(String::new, |name| name.to_string());
    format!("{structure} {module} {}", standing.words())
}

fn component_text(component: &FaultTransition) -> String {
    let kind = component.identification.as_deref().map(identified).unwrap_or_default();
    let (state, why) = (state_in_words(component), reason(component));
    let (structure, aside) = (&component.structure, aside(component).unwrap_or_default());
    format!("{structure} {} {state} {kind} {why} {aside}", component.component)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{heard, scene, state};

    fn names(scene: &Scene, filter: &str) -> Vec<String> {
        let name = |row: &Row| match row {
            Row::Module(whose) => whose.module.to_string(),
            Row::Component(subject) => subject.component.to_string(),
        };
        rows(scene, &Filter(filter.to_owned()), None).iter().map(name).collect()
    }

    #[test]
    fn a_silent_module_stands_between_faults_and_doubts_and_for_its_unknown_components() {
        let mut silent = heard("m2", vec![state("m2/sensor/g1", FaultState::Unknown, 3)]);
        silent.silent_since_unix_ns = Some(1);
        silent.picture.components[0].unknown =
            Some(wire::Unknown { since_unix_ns: 1, reason: "not heard".to_owned() });
        let first = heard(
            "m1",
            vec![
                state("m1/sensor/g1", FaultState::Unconfirmed, 9),
                state("m1/sensor/g2", FaultState::Latched, 2),
                state("m1/sensor/g3", FaultState::Latched, 4),
                state("m1/sensor/g4", FaultState::Normal, 4),
            ],
        );
        let scene = scene(vec![first, silent]);
        let expected = ["m1/sensor/g2", "m1/sensor/g3", "m2", "m1/sensor/g1"];
        assert_eq!(names(&scene, ""), expected);
        assert_eq!(names(&scene, "silent"), ["m2"]);
        assert_eq!(names(&scene, "m2"), ["m2", "m2/sensor/g1"]);
        assert_eq!(names(&scene, "LATCHED g2"), ["m1/sensor/g2"]);
    }

    #[test]
    fn in_the_scope_of_a_module_its_normal_components_have_rows_too() {
        let scene = scene(vec![
            heard("m1", vec![state("m1/sensor/g1", FaultState::Normal, 1)]),
            heard("m2", vec![state("m2/sensor/g1", FaultState::Latched, 1)]),
        ]);
        let scope = modules(&scene).swap_remove(0);
        let only = rows(&scene, &Filter::default(), Some(&scope));
        assert_eq!(only, [Row::Component(Subject::of(&scene.modules[0].picture.components[0]))]);
    }
}
