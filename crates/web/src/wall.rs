//! The wall display: the verdict to be read from afar, the whole structure, and the faulty member enlarged, on one screen.

use axum::extract::State;
use axum::response::Response;
use maud::{Markup, html};
use observer::{NetworkState, StateRow, alarms, all_is_well, attention};
use vocabulary::words::{Tone, age};

use crate::access::Viewer;
use crate::app::Shared;
use crate::drawing::LinkedDrawing;
use crate::layout::Page;
use crate::live_page::LivePage;
use crate::look;
use crate::overview::alarms::href;
use crate::part::{PagePart, part};
use crate::view::LinkedScene;

/// Incidents that have a line; of further ones only the number is shown.
const SHOWN: usize = 4;

/// `/wall`
pub(crate) async fn page(State(app): State<Shared>, viewer: Viewer) -> Response {
    let scene = app.observed.scene();
    let (view, title) = (LinkedScene::new(&scene), scene.summary());
    let main = main(&view, app.drawing.as_ref());
    let live = LivePage::Wall.parameters();
    Page { title: &title, place: "/wall", live, viewer: &viewer, scene: &scene }.respond(&main)
}

/// The parts that change.
pub(crate) fn parts(view: &LinkedScene<'_>, drawing: Option<&LinkedDrawing>) -> Vec<PagePart> {
    let mut parts =
        vec![part("verdict", verdict(view)), part("incidents", incidents(view, drawing))];
    if let Some(drawing) = drawing {
        parts.push(part("signs", drawing.signs(view)));
    }
    parts
}

fn main(view: &LinkedScene<'_>, drawing: Option<&LinkedDrawing>) -> Markup {
    html! {
        div #verdict role="status" { (verdict(view)) }
        div.wall {
            @if let Some(drawing) = drawing { (drawing.markup(view)) }
            div #incidents { (incidents(view, drawing)) }
        }
    }
}

/// Whether all is well, in a few words; what is not known is never well.
fn verdict(view: &LinkedScene<'_>) -> Markup {
    let scene = view.scene;
    let urgent = attention(&alarms(&scene.modules));
    let (sign, words) = match (&scene.network, urgent) {
        (NetworkState::Open, 0) if all_is_well(scene) => ("normal", "All is well".to_owned()),
        (NetworkState::Open, 0) => ("unknown", "Not known to be well".to_owned()),
        (NetworkState::Open, 1) => ("latched", "1 incident".to_owned()),
        (NetworkState::Open, urgent) => ("latched", format!("{urgent} incidents")),
        _ => ("unknown", "Nothing is known".to_owned()),
    };
    html! {
        h1.state.(sign) { (look::sign(sign)) (words) }
        p.counts { (scene.summary()) }
    }
}

fn incidents(view: &LinkedScene<'_>, drawing: Option<&LinkedDrawing>) -> Markup {
    let mut rows = alarms(&view.scene.modules);
    rows.retain(|row| row.urgency.needs_attention());
    let first = rows.first().and_then(|row| Some((row, row.component.as_ref()?)));
    html! {
        ol.list {
            @for row in rows.iter().take(SHOWN) { (line(view, row)) }
        }
        @if rows.len() > SHOWN { p.more { "and " (rows.len() - SHOWN) " more" } }
        @if let (Some(drawing), Some((row, component))) = (drawing, first) {
            (drawing.place(view, row.structure.as_ref(), component))
        }
    }
}

fn line(view: &LinkedScene<'_>, row: &StateRow) -> Markup {
    html! {
        li.alarm.(look::classes(row)) {
            (look::state(row))
            a.what href=(href(view, row)) { (row.name()) }
            span.kind { (row.what()) }
            @if let Some(since) = row.since_unix_ns {
                @let is_alarm = row.tone == Tone::Alarm;
                p.meta { @if is_alarm { "for " } @else { "since " } (age(since, view.scene.time_unix_ns)) }
            }
        }
    }
}
