//! Events, latest first, updated live.

use std::sync::Arc;

use axum::extract::State;
use axum::response::Response;
use maud::{Markup, html};
use observer::{CountedLine, counted};

use crate::access::Viewer;
use crate::app::Shared;
use crate::layout::Page;
use crate::look;
use crate::part::{PagePart, part};
use crate::view::LinkedScene;

/// What the page shows.
pub(crate) const TITLE: &str = "Events";
/// Most events on the overview, and on the events page.
const FEW: usize = 6;
const MANY: usize = 200;

/// `/events`
pub(crate) async fn page(State(app): State<Shared>, viewer: Viewer) -> Response {
    let scene = app.observed.scene();
    let view = LinkedScene::new(&scene);
    let page = Page {
        title: TITLE,
        place: "/events",
        live: "page=events".to_owned(),
        viewer: &viewer,
        scene: &scene,
    };
    page.respond(&main(&view))
}

pub(crate) fn main(view: &LinkedScene<'_>) -> Markup {
    html! {
        h1 { "Events" }
        p { "What this process has heard since it started, the latest first; earlier ones: "
            a href="/history" { "the journals" } "." }
        div #events { (list(view, MANY)) }
    }
}

/// The parts that change.
pub(crate) fn parts(view: &LinkedScene<'_>) -> Vec<PagePart> {
    vec![part("events", list(view, MANY))]
}

/// The latest events, for the overview.
pub(crate) fn latest(view: &LinkedScene<'_>) -> Markup {
    list(view, FEW)
}

fn list(view: &LinkedScene<'_>, most: usize) -> Markup {
    html! {
        @if view.scene.events.is_empty() { p.nothing { "Nothing yet." } }
        @else {
            ol.log {
                @for one in counted(view.scene.events.iter().rev().map(Arc::as_ref)).iter().take(most) {
                    (line(view, one))
                }
            }
        }
    }
}

/// Time, event, subject and reason.
fn line(view: &LinkedScene<'_>, counted: &CountedLine) -> Markup {
    let CountedLine { line, times, first_unix_ns } = counted;
    html! {
        li {
            (look::when(line.time_unix_ns)) " " (look::event(line)) " "
            @match (&line.component, &line.module) {
                (Some(path), _) => a href=(view.component(line.structure.as_ref(), path)) { (line.who) },
                (None, Some(module)) => a href=(view.module(line.structure.as_ref(), module)) { (line.who) },
                (None, None) => (line.who),
            }
            @if *times > 1 { b.times { " " (times) " times since " } (look::when(*first_unix_ns)) }
            @if let Some(step) = line.step { span.step { " step " (step) } }
            @if !line.why.is_empty() { ": " (line.why) }
        }
    }
}
