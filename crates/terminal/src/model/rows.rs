//! The rows of the lists, most urgent first.

use observer::{ModuleId, ModuleView, Scene, StateRow, Urgency, alarms, rows};

/// Rows that are not normal. With a module in `scope`, all its components; with a filter, all rows that match.
pub(crate) fn listed(scene: &Scene, filter: &str, scope: Option<&ModuleId>) -> Vec<StateRow> {
    let scoped: Vec<ModuleView>;
    let mut listed = if let Some(scope) = scope {
        scoped = scene.view_of(scope).cloned().into_iter().collect();
        rows(&scoped)
    } else if filter.trim().is_empty() {
        alarms(&scene.modules)
    } else {
        let mut rows = rows(&scene.modules);
        rows.retain(|row| row.urgency != Urgency::Normal);
        rows
    };
    listed.retain(|row| admits(filter, &text(row)));
    listed
}

/// Whether a text contains every word of the filter, ignoring case.
fn admits(filter: &str, text: &str) -> bool {
    let text = text.to_lowercase();
    filter.to_lowercase().split_whitespace().all(|word| text.contains(word))
}

fn text(row: &StateRow) -> String {
    let structure = row.structure.as_ref().map_or("", |name| name.as_str());
    format!("{structure} {} {} {} {}", row.name(), row.state, row.what(), row.why)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{heard, scene, state};
    use observer::{ComponentId, RowId};
    use vocabulary::FaultState;

    #[test]
    fn every_word_has_to_be_there_in_any_order_and_case() {
        assert!(admits("G2 latched", "Latched module1/sensor/g2"));
        assert!(!admits("G2 latched", "latched module1/sensor/g1"));
        assert!(admits("", "") && admits(" ", "x"));
    }

    #[test]
    fn rows_are_looked_for_by_words_and_what_is_unknown_because_of_its_module_is_found_too() {
        let mut unknown = state("m2/sensor/g1", FaultState::Unknown, 3);
        let reason = "not heard".to_owned();
        unknown.unknown = Some(vocabulary::Unknown { since_unix_ns: 1, reason });
        let silent = observer::ModuleView { is_silent: true, ..heard("m2", vec![unknown]) };
        let first = heard("m1", vec![state("m1/sensor/g2", FaultState::Latched, 2)]);
        let scene = scene(vec![first, silent]);
        let names = |filter: &str| -> Vec<String> {
            let rows = listed(&scene, filter, None);
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
        let scope = scene.modules[0].id();
        let only = listed(&scene, "", Some(&scope));
        let own = RowId::Component(ComponentId::of(&scene.modules[0].components[0]));
        assert_eq!(only.iter().map(StateRow::id).collect::<Vec<_>>(), [own]);
    }
}
