//! A card for each module: phase, lag, age of samples, when it was heard, journal, and its components.

use maud::{Markup, html};
use observer::{ModuleView, StateRow, title};
use vocabulary::StructureName;
use vocabulary::words::or_nothing;

use super::alarms::href;
use crate::drawing::LinkedDrawing;
use crate::look;
use crate::view::LinkedScene;

/// The modules of every structure.
pub(super) fn cards(view: &LinkedScene<'_>, drawing: Option<&LinkedDrawing>) -> Markup {
    html! {
        @for (structure, modules) in view.structures() {
            @if view.several { h3 { (structure.map_or("of no known structure", StructureName::as_str)) } }
            div.cards { @for module in modules { (card(view, drawing, module)) } }
        }
        @if view.scene.modules.is_empty() { p.nothing { "No module answers." } }
    }
}

fn card(view: &LinkedScene<'_>, drawing: Option<&LinkedDrawing>, module: &ModuleView) -> Markup {
    let structure = module.structure.as_ref();
    let drawn = structure.is_some_and(|name| drawing.is_some_and(|drawing| drawing.is_of(name)));
    let name = html! { a href=(view.module(structure, &module.module)) { (module.module) } };
    html! {
        article.card.(observer::sign(module.tone())) {
            header {
                // One level below the heading of the structure, if there is one.
                @if view.several { h4 { (name) } } @else { h3 { (name) } }
                (look::condition(module))
            }
            (facts(view, module))
            @if !drawn { (components(view, module)) }
        }
    }
}

/// The module's reports about itself. Of a silent one only what is still known.
pub(crate) fn facts(view: &LinkedScene<'_>, module: &ModuleView) -> Markup {
    let Some(status) = &module.status else {
        return html! { p.nothing { "No status was received yet." } };
    };
    let (journal, remarks) = (module.journal(), module.remarks());
    let is_kept = journal.as_ref().is_some_and(|journal| journal.is_kept);
    html! {
        dl.facts {
            div { dt { "components" } dd { (module.counts().words()) } }
            div { dt { "lag" } dd { (or_nothing(module.lag())) } }
            div { dt { "age of samples" } dd { (or_nothing(module.sample_age())) } }
            div { dt { "heard" } dd { (module.heard(view.scene.time_unix_ns)) } }
            div { dt { "journal" } dd {
                (or_nothing(journal)) @if is_kept { ", " (status.journal.bytes / 1000) " kB" }
            } }
        }
        @if !remarks.is_empty() { p.aside-note { (remarks) } }
    }
}

/// The components as signs with names, for a module that is not drawn.
fn components(view: &LinkedScene<'_>, module: &ModuleView) -> Markup {
    html! {
        ul.chips {
            @for state in &module.components {
                @let row = StateRow::of_component(state);
                li {
                    a.chip.(look::classes(&row)) href=(href(view, &row)) title=(title(state)) {
                        (look::sign(row.sign))
                        span { (state.component.component.name()) }
                        span.hidden { " " (row.state) }
                    }
                }
            }
        }
    }
}
