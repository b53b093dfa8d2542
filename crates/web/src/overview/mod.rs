//! The overview: what needs attention, the drawing, the modules.
//!
//! | file | what |
//! |---|---|
//! | `counts` | the whole in a sentence |
//! | `alarms` | what needs attention, the most urgent first |
//! | `trouble` | what is wrong with a module |
//! | `modules` | a card for each module |

pub(crate) mod alarms;
mod counts;
pub(crate) mod modules;
pub(crate) mod trouble;

use axum::extract::State;
use axum::response::Response;
use maud::{Markup, html};
use names::StructureName;

use crate::access::Viewer;
use crate::app::Shared;
use crate::events;
use crate::layout::Page;
use crate::part::{Part, part};
use crate::view::View;

/// `/`
pub(crate) async fn page(State(app): State<Shared>, viewer: Viewer) -> Response {
    let scene = app.live.scene();
    let view = View::new(&scene, app.drawing.as_ref());
    let title = counts::sentence(&view);
    let live = "page=overview".to_owned();
    Page { title: &title, place: "/", live, viewer: &viewer, scene: &scene }.around(&main(&view))
}

/// What changes in it.
pub(crate) fn parts(view: &View<'_>) -> Vec<Part> {
    let mut parts = vec![
        part("names", names(view)),
        part("counts", html! { (counts::sentence(view)) }),
        part("alarms", alarms::urgent(view)),
        part("others", alarms::others(view)),
        part("modules", modules::cards(view)),
        part("latest", events::latest(view)),
    ];
    if let Some(drawing) = view.drawing {
        parts.push(part("signs", drawing.signs(|structure, path| view.shown(structure, path))));
    }
    parts
}

pub(crate) fn main(view: &View<'_>) -> Markup {
    html! {
        div.title {
            h1 #names { (names(view)) }
            p.counts #counts role="status" { (counts::sentence(view)) }
        }
        div.overview.drawn[view.drawing.is_some()] {
            section.alarms aria-labelledby="alarms-title" {
                h2 #alarms-title { "Needs attention" }
                div #alarms { (alarms::urgent(view)) }
                div #others { (alarms::others(view)) }
            }
            @if let Some(drawing) = view.drawing {
                section.structure aria-labelledby="drawing-title" {
                    h2 #drawing-title { "Structure" }
                    (drawing.markup(|structure, path| view.shown(structure, path)))
                    (legend())
                }
            }
            section.modules aria-labelledby="modules-title" {
                h2 #modules-title { "Modules" }
                div #modules { (modules::cards(view)) }
            }
            section.events aria-labelledby="events-title" {
                h2 #events-title { "Latest events" }
                div #latest { (events::latest(view)) }
                p { a href="/events" { "All events" } }
            }
        }
    }
}

/// What is looked at.
fn names(view: &View<'_>) -> Markup {
    let names: Vec<&str> =
        view.structures().into_iter().flatten().map(StructureName::as_str).collect();
    html! { @if names.is_empty() { "No structure seen" } @else { (names.join(", ")) } }
}

/// What the signs in the drawing mean.
fn legend() -> Markup {
    let entries = ["latched", "acknowledged", "unconfirmed", "unknown", "explained", "tentative"];
    html! {
        ul.legend aria-label="Signs" {
            @for entry in entries {
                li.state.(entry) { (crate::look::sign(entry)) (entry) }
            }
            li.state.normal { span.swatch {} "normal" }
            li.state.unverified { span.swatch {} "normal, not verified" }
            li.state.absent { span.swatch {} "not heard of" }
        }
    }
}
