//! The overview: alarms, the drawing, the modules.
//!
//! | file | what |
//! |---|---|
//! | `alarms` | alarms by urgency |
//! | `modules` | a card for each module |

pub(crate) mod alarms;
pub(crate) mod modules;

use axum::extract::State;
use axum::response::Response;
use maud::{Markup, html};
use vocabulary::StructureName;

use crate::access::{Person, Viewer};
use crate::app::Shared;
use crate::drawing::LinkedDrawing;
use crate::events;
use crate::forms::may_order;
use crate::layout::Page;
use crate::part::{PagePart, part};
use crate::view::LinkedScene;

/// `/`
pub(crate) async fn page(State(app): State<Shared>, viewer: Viewer) -> Response {
    let scene = app.observed.scene();
    let (view, title) = (LinkedScene::new(&scene), scene.summary());
    let main = html! {
        div #notifier role="status" { (app.troubles()) }
        (main(&view, app.drawing.as_ref(), may_order(&viewer)))
    };
    let live = "page=overview".to_owned();
    Page { title: &title, place: "/", live, viewer: &viewer, scene: &scene }.respond(&main)
}

/// The parts that change.
pub(crate) fn parts(view: &LinkedScene<'_>, drawing: Option<&LinkedDrawing>) -> Vec<PagePart> {
    let mut parts = vec![
        part("names", names(view)),
        part("counts", html! { (view.scene.summary()) }),
        part("alarms", alarms::urgent(view)),
        part("others", alarms::others(view)),
        part("modules", modules::cards(view, drawing)),
        part("latest", events::latest(view)),
    ];
    if let Some(drawing) = drawing {
        parts.push(part("signs", drawing.signs(view)));
    }
    parts
}

pub(crate) fn main(
    view: &LinkedScene<'_>,
    drawing: Option<&LinkedDrawing>,
    person: Option<&Person>,
) -> Markup {
    html! {
        div.title {
            h1 #names { (names(view)) }
            p.counts #counts role="status" { (view.scene.summary()) }
        }
        div.overview.drawn[drawing.is_some()] {
            section.alarms aria-labelledby="alarms-title" {
                h2 #alarms-title { "Needs attention" }
                div #alarms { (alarms::urgent(view)) }
                @if let Some(person) = person { (alarms::acknowledge_selected(person)) }
                div #others { (alarms::others(view)) }
            }
            @if let Some(drawing) = drawing {
                section.structure aria-labelledby="drawing-title" {
                    h2 #drawing-title { "Structure" }
                    (drawing.markup(view))
                    (legend())
                }
            }
            section.modules aria-labelledby="modules-title" {
                h2 #modules-title { "Modules" }
                div #modules { (modules::cards(view, drawing)) }
            }
            section.events aria-labelledby="events-title" {
                h2 #events-title { "Latest events" }
                div #latest { (events::latest(view)) }
                p { a href="/events" { "All events" } }
            }
        }
    }
}

/// The names of the observed structures.
fn names(view: &LinkedScene<'_>) -> Markup {
    let names: Vec<&str> =
        view.structures().filter_map(|(name, _)| name.map(StructureName::as_str)).collect();
    html! { @if names.is_empty() { "No structure seen" } @else { (names.join(", ")) } }
}

/// Explains the signs in the drawing.
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
