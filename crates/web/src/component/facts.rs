//! A component's state with reasons, and the kind of its fault.

use maud::{Markup, html};
use observer::{StateRow, explained_by, known_identification};
use vocabulary::words::{candidate, percent};
use vocabulary::{FaultTransition, Identification};

use crate::look;
use crate::view::LinkedScene;

/// Its present state with the reason.
pub(super) fn verdict(view: &LinkedScene<'_>, state: &FaultTransition) -> Markup {
    let row = StateRow::of_component(state);
    html! {
        div.verdict.(look::classes(&row)) {
            p.headline { (look::state(&row)) @if !row.kind.is_empty() { span.kind { (row.kind) } } }
            @if !row.why.is_empty() { p.why { (row.why) } }
            @if let Some(incident) = &row.incident { p { a href={ "/incident?id=" (incident.replace('@', "%40")) } { "All that belongs to it, to print" } } }
            @if let Some(root) = explained_by(state) {
                // Of a module that is not heard, according to its latest message.
                p { @if state.unknown.is_some() { "Last known to be explained by " } @else { "Explained by " } a href=(view.component(row.structure.as_ref(), root)) { (root) } "." }
            }
        }
    }
}

/// The measurements, and the kinds of fault that it may be.
pub(super) fn facts(state: &FaultTransition) -> Markup {
    html! {
        (figures(&StateRow::of_component(state)))
        @if let Some(found) = known_identification(state) { (candidates(found)) }
    }
}

fn figures(row: &StateRow) -> Markup {
    html! {
        dl.facts {
            @if let Some(since) = row.since_unix_ns { div { dt { "since" } dd { (look::when(since)) } } }
            @for (name, fact) in row.facts() { div { dt { (name) } dd { (fact) } } }
        }
    }
}

fn candidates(found: &Identification) -> Markup {
    html! {
        table.candidates {
            caption { "What kind of fault it may be, as of step " (found.as_of_step) }
            thead { tr { th scope="col" { "kind and size" } th.number scope="col" { "probability" } } }
            tbody {
                @for one in &found.candidates {
                    tr { td { (candidate(one)) } td.number { (percent(one.probability)) } }
                }
            }
        }
    }
}
