//! Which rows there are, the most urgent first.

use observer::{ModuleView, Scene, StateRow, Urgency, alarms, rows};

use super::filter::Filter;
use super::subject::{Subject, Whose};

/// What the cursor of the list of alarms is on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Row {
    Module(Whose),
    Component(Subject),
}

impl Row {
    pub(crate) fn of(row: &StateRow) -> Self {
        match (&row.structure, &row.component) {
            (Some(structure), Some(component)) => {
                let (structure, component) = (structure.clone(), component.clone());
                Self::Component(Subject { structure, component })
            }
            _ => {
                Self::Module(Whose { structure: row.structure.clone(), module: row.module.clone() })
            }
        }
    }
}

/// What is not normal. Of a module in `scope`, every component; with a filter, whatever it admits.
pub(crate) fn listed(scene: &Scene, filter: &Filter, scope: Option<&Whose>) -> Vec<StateRow> {
    let scoped: Vec<ModuleView>;
    let mut listed = if let Some(scope) = scope {
        scoped = scope.find(scene).cloned().into_iter().collect();
        rows(&scoped)
    } else if filter.is_empty() {
        alarms(&scene.modules)
    } else {
        let mut rows = rows(&scene.modules);
        rows.retain(|row| row.urgency != Urgency::Normal);
        rows
    };
    listed.retain(|row| filter.admits(&text(row)));
    listed
}

/// The modules.
pub(crate) fn modules(scene: &Scene) -> Vec<Whose> {
    scene.modules.iter().map(Whose::of).collect()
}

fn text(row: &StateRow) -> String {
    let structure = row.structure.as_ref().map_or("", |name| name.as_str());
    format!("{structure} {} {} {} {}", row.name(), row.state, row.kind, row.why)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{heard, scene, state};
    use vocabulary::FaultState;

    #[test]
    fn rows_are_looked_for_by_words_and_what_is_unknown_because_of_its_module_is_found_too() {
        let mut unknown = state("m2/sensor/g1", FaultState::Unknown, 3);
        let reason = "not heard".to_owned();
        unknown.unknown = Some(vocabulary::Unknown { since_unix_ns: 1, reason });
        let silent = observer::ModuleView { is_silent: true, ..heard("m2", vec![unknown]) };
        let first = heard("m1", vec![state("m1/sensor/g2", FaultState::Latched, 2)]);
        let scene = scene(vec![first, silent]);
        let names = |filter: &str| -> Vec<String> {
            let rows = listed(&scene, &Filter(filter.to_owned()), None);
            rows.iter().map(StateRow::name).collect()
        };
        assert_eq!(names(""), ["m1/sensor/g2", "m2"]);
        assert_eq!(names("answering"), ["m2"]);
        assert_eq!(names("m2"), ["m2", "m2/sensor/g1"]);
        assert_eq!(names("LATCHED g2"), ["m1/sensor/g2"]);
    }

    #[test]
    fn in_the_scope_of_a_module_its_normal_components_have_rows_too() {
        let scene = scene(vec![
            heard("m1", vec![state("m1/sensor/g1", FaultState::Normal, 1)]),
            heard("m2", vec![state("m2/sensor/g1", FaultState::Latched, 1)]),
        ]);
        let scope = modules(&scene).swap_remove(0);
        let only = listed(&scene, &Filter::default(), Some(&scope));
        let own = Row::Component(Subject::of(&scene.modules[0].components[0]));
        assert_eq!(only.iter().map(Row::of).collect::<Vec<_>>(), [own]);
    }
}
