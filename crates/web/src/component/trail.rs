//! Draws which change explains which, from the root cause to its effects.

use std::collections::{BTreeMap, BTreeSet};

use maud::{Markup, html};
use observer::{StateRow, explained_by};
use vocabulary::{ComponentPath, FaultState, FaultTransition, ModuleName};

use super::evidence::ModuleAnswers;
use crate::look;
use crate::view::LinkedScene;

/// Size of a box, and the space between boxes \[px\].
const BOX: [usize; 2] = [190, 44];
const GAP: [usize; 2] = [70, 14];
/// Most components drawn.
const MOST: usize = 24;

/// An edge: one change explains another.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Edge {
    root: ComponentPath,
    /// Whether it does so at present; otherwise according to the journal.
    present: bool,
}

/// Edges by effect.
type Edges = BTreeMap<ComponentPath, Edge>;

/// The drawing, or a note that there is nothing to draw.
pub(super) fn trail(
    view: &LinkedScene<'_>,
    transition: &FaultTransition,
    evidence: &ModuleAnswers,
) -> Markup {
    let edges = edges(view, transition, evidence);
    let shown = connected(&edges, &transition.component);
    if shown.len() < 2 {
        let unread: Vec<&str> = evidence.unread().map(ModuleName::as_str).collect();
        return html! {
            p.nothing {
                @if unread.is_empty() { "It explains no other change, and none explains it." }
                @else { "No explanation is known; not read: the journal of " (unread.join(", ")) "." }
            }
        };
    }
    let places = laid_out(&edges, &shown);
    let [columns, rows] =
        places.values().fold([0, 0], |[x, y], place| [x.max(place[0]), y.max(place[1])]);
    let size = [(columns + 1) * (BOX[0] + GAP[0]), (rows + 1) * (BOX[1] + GAP[1])];
    html! {
        svg.trail viewBox={ "0 0 " (size[0]) " " (size[1]) } width=(size[0]) height=(size[1])
            role="group" aria-label="From the root on the left to its effects" {
            @for (effect, edge) in &edges {
                @if let (Some(from), Some(to)) = (places.get(&edge.root), places.get(effect)) {
                    (arrow(*from, *to, edge.present))
                }
            }
            @for (component, place) in &places {
                (node(view, transition, component, *place))
            }
        }
        p.note { "Arrows point from the explaining change to the explained one; dashed: past, from the journal." }
    }
}

fn edges(view: &LinkedScene<'_>, transition: &FaultTransition, evidence: &ModuleAnswers) -> Edges {
    let present = view.scene.components().filter(|c| c.structure == transition.structure);
    standing(evidence.transitions(), present)
}

/// The explanations that still hold: one ends with the next transition of its effect that is explained by nothing. Of a
/// component whose module does not report, the latest one in the journal stands, as past.
fn standing<'a>(
    journal: impl Iterator<Item = &'a FaultTransition>,
    present: impl Iterator<Item = &'a FaultTransition>,
) -> Edges {
    let mut edges = Edges::new();
    let dated = journal.map(|one| (one, false)).chain(present.map(|one| (one, true)));
    for (one, present) in dated {
        match explained_by(one) {
            Some(root) => {
                // A silent module keeps its latest state.
                let present = present && one.unknown.is_none();
                edges.insert(one.component.clone(), Edge { root: root.clone(), present });
            }
            None if one.state() == FaultState::Unknown => {}
            None => {
                edges.remove(&one.component);
            }
        }
    }
    edges
}

/// All components connected with this one.
fn connected(edges: &Edges, component: &ComponentPath) -> BTreeSet<ComponentPath> {
    let mut found = BTreeSet::from([component.clone()]);
    let mut grown = true;
    while grown && found.len() < MOST {
        grown = false;
        for (effect, edge) in edges {
            if found.contains(effect) != found.contains(&edge.root) && found.len() < MOST {
                found.insert(effect.clone());
                found.insert(edge.root.clone());
                grown = true;
            }
        }
    }
    found
}

/// Column and row of each component: the column is the number of steps to the root cause.
fn laid_out(edges: &Edges, shown: &BTreeSet<ComponentPath>) -> BTreeMap<ComponentPath, [usize; 2]> {
    let mut rows: BTreeMap<usize, usize> = BTreeMap::new();
    let mut places = BTreeMap::new();
    for component in shown {
        let column = depth(edges, component);
        let row = rows.entry(column).or_default();
        places.insert(component.clone(), [column, *row]);
        *row += 1;
    }
    places
}

/// Number of steps to the root cause; bounded in case changes explain each other in a circle.
fn depth(edges: &Edges, component: &ComponentPath) -> usize {
    let mut at = component;
    let mut depth = 0;
    while let Some(edge) = edges.get(at).filter(|_| depth < MOST) {
        (at, depth) = (&edge.root, depth + 1);
        if at == component {
            return 0;
        }
    }
    depth
}

fn corner([column, row]: [usize; 2]) -> [usize; 2] {
    [column * (BOX[0] + GAP[0]) + GAP[0] / 4, row * (BOX[1] + GAP[1]) + GAP[1] / 2]
}

fn arrow(from: [usize; 2], to: [usize; 2], present: bool) -> Markup {
    let ([x1, y1], [x2, y2]) = (corner(from), corner(to));
    let (x1, y1, y2) = (x1 + BOX[0], y1 + BOX[1] / 2, y2 + BOX[1] / 2);
    let middle = x1 / 2 + x2 / 2;
    let tip = x2.saturating_sub(1);
    html! {
        path.arrow.past[!present] d={ "M" (x1) " " (y1) "C" (middle) " " (y1) " " (middle) " " (y2) " " (tip) " " (y2) } {}
        path.head d={ "M" (tip) " " (y2) "l-9 -4.5v9z" } {}
    }
}

fn node(
    view: &LinkedScene<'_>,
    own: &FaultTransition,
    component: &ComponentPath,
    place: [usize; 2],
) -> Markup {
    let [x, y] = corner(place);
    let row = view.scene.component(Some(&own.structure), component).map(StateRow::of_component);
    let class = row.as_ref().map_or_else(|| "absent".to_owned(), look::classes);
    let words = row.map_or_else(|| "not heard of".to_owned(), |row| row.state);
    let is_own = *component == own.component;
    html! {
        a.node.(class).own[is_own] href=(view.component(Some(&own.structure), component)) {
            rect x=(x) y=(y) width=(BOX[0]) height=(BOX[1]) rx="5" {}
            text x=(x + 12) y=(y + 18) { (component) }
            text.words x=(x + 12) y=(y + 35) { (words) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vocabulary::Verdict;

    fn path(text: &str) -> ComponentPath {
        text.parse().unwrap()
    }

    fn edges(pairs: &[(&str, &str)]) -> Edges {
        let edge = |(effect, root): &(&str, &str)| {
            (path(effect), Edge { root: path(root), present: true })
        };
        pairs.iter().map(edge).collect()
    }

    #[test]
    fn effects_stand_to_the_right_of_what_explains_them() {
        let edges = edges(&[
            ("m1/sensor/g1", "m1/actuator/A1"),
            ("m1/sensor/g2", "m1/sensor/g1"),
            ("m2/sensor/g1", "m1/actuator/A1"),
            ("m2/sensor/g8", "m2/sensor/g9"),
        ]);
        let shown = connected(&edges, &path("m2/sensor/g1"));
        let places = laid_out(&edges, &shown);
        let column = |name: &str| places.get(&path(name)).map(|place| place[0]);
        assert_eq!(column("m1/actuator/A1"), Some(0));
        assert_eq!((column("m1/sensor/g1"), column("m2/sensor/g1")), (Some(1), Some(1)));
        assert_eq!(column("m1/sensor/g2"), Some(2));
        assert_eq!(column("m2/sensor/g8"), None);
        let distinct: BTreeSet<_> = places.values().collect();
        assert_eq!(distinct.len(), places.len());
    }

    #[test]
    fn an_explanation_ends_when_its_effect_returns_to_normal() {
        let transition = |verdict| FaultTransition {
            verdict,
            ..FaultTransition::untouched("t".parse().unwrap(), path("m1/sensor/g1"), 0)
        };
        let by = path("m1/actuator/A1");
        let explained =
            || transition(Verdict::Explained { by: by.clone(), since: vocabulary::Step(7) });
        let unknown = vocabulary::Unknown { since_unix_ns: 1, reason: "not heard".to_owned() };
        let silent = |of: FaultTransition| of.while_unknown(unknown.clone());
        let edge = |present| Some(Edge { root: by.clone(), present });
        for (journal, now, expected) in [
            (vec![explained()], explained(), edge(true)),
            (vec![explained()], silent(explained()), edge(false)),
            (vec![explained()], silent(transition(Verdict::Normal)), edge(false)),
            (vec![explained()], transition(Verdict::Normal), None),
            (
                vec![explained(), transition(Verdict::Normal)],
                silent(transition(Verdict::Normal)),
                None,
            ),
            (vec![explained(), transition(Verdict::Normal)], transition(Verdict::Latched), None),
            (vec![transition(Verdict::Latched), explained()], explained(), edge(true)),
        ] {
            let standing = standing(journal.iter(), std::iter::once(&now));
            assert_eq!(
                standing.get(&path("m1/sensor/g1")),
                expected.as_ref(),
                "{journal:?} {now:?}"
            );
        }
    }

    #[test]
    fn changes_that_are_said_to_explain_each_other_can_be_drawn() {
        let circle = edges(&[
            ("m1/sensor/g1", "m1/sensor/g2"),
            ("m1/sensor/g2", "m1/sensor/g1"),
            ("m1/sensor/g3", "m1/sensor/g1"),
        ]);
        let shown = connected(&circle, &path("m1/sensor/g1"));
        assert_eq!(laid_out(&circle, &shown).len(), 3);
    }
}
