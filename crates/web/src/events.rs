//! What has happened, the latest first, as it happens.

use axum::extract::State;
use axum::response::Response;
use maud::{Markup, html};
use observer::{Event, News};
use wire::FaultTransition;
use wording::{identified, phase_in_words, phase_tone, printable, reason};

use crate::access::Viewer;
use crate::app::Shared;
use crate::layout::Page;
use crate::look;
use crate::stream::{Part, part};
use crate::view::View;

/// Events on the overview, and on the page of their own.
const FEW: usize = 6;
const MANY: usize = 200;

/// `/events`
pub(crate) async fn page(State(app): State<Shared>, viewer: Viewer) -> Response {
    let scene = app.live.scene();
    let view = View::new(&scene, app.drawing.as_ref());
    let page = Page {
        title: "Events",
        place: "/events",
        live: "page=events".to_owned(),
        viewer: &viewer,
        scene: &scene,
    };
    page.around(&main(&view))
}

pub(crate) fn main(view: &View<'_>) -> Markup {
    html! {
        h1 { "Events" }
        p { "What has been heard since this process was started, the latest first; what was before, "
            a href="/history" { "the journals" } " hold." }
        div #events { (list(view, MANY)) }
    }
}

/// What changes in it.
pub(crate) fn parts(view: &View<'_>) -> Vec<Part> {
    vec![part("events", list(view, MANY))]
}

/// The latest few.
pub(crate) fn latest(view: &View<'_>) -> Markup {
    list(view, FEW)
}

fn list(view: &View<'_>, most: usize) -> Markup {
    html! {
        @if view.scene.events.is_empty() { p.nothing { "Nothing yet." } }
        @else {
            ol.log { @for event in view.scene.events.iter().rev().take(most) { (line(view, event)) } }
        }
    }
}

fn line(view: &View<'_>, event: &Event) -> Markup {
    html! { li { (look::when(event.time_unix_ns)) " " (words(view, &event.news)) } }
}

fn words(view: &View<'_>, news: &News) -> Markup {
    match news {
        News::Fault(transition) => verdict(view, transition),
        News::Identification(found) => html! {
            a href=(view.component(Some(&found.structure), &found.component)) { (found.component) }
            ": " (identified(found))
        },
        News::Phase(change) => {
            let class = look::tone_class(phase_tone(change.phase));
            html! {
                span.state.(class) { (look::sign(class)) (phase_in_words(change.phase)) }
                " " a href=(view.module(Some(&change.structure), &change.module)) { (change.module) }
                ": " (printable(&change.reason))
            }
        }
        News::Presence { structure, who, there } => {
            let what = if *there { "is on the network" } else { "has left the network" };
            html! { (printable(who)) " of " (structure) " " (what) }
        }
        News::SeveralProcesses { structure, module } => html! {
            "several processes run as " (module) " of " (structure) ": stop all but one"
        },
        News::Missed { module, from, to, reason, .. } => html! {
            "transitions " (from) " to " (to) " of " (module) " were missed: " (printable(reason))
        },
        News::Unreadable { problem, .. } => {
            html! { "a message could not be read: " (printable(problem)) }
        }
        News::Lost(count) => html! { (count) " events were lost: this process was too slow" },
    }
}

/// A component's new state, and why.
pub(crate) fn verdict(view: &View<'_>, transition: &FaultTransition) -> Markup {
    let why = reason(transition);
    html! {
        (verdict_state(transition)) " "
        a href=(view.component(Some(&transition.structure), &transition.component)) { (transition.component) }
        @if let Some(step) = transition.decided_step { span.step { " step " (step) } }
        @if !why.is_empty() { ": " (why) }
    }
}

/// A transition does not say how the component stands to its reference: its `normal` is the end of a change.
pub(crate) fn verdict_state(transition: &FaultTransition) -> Markup {
    let class = look::class(transition);
    html! { span.state.(class) { (look::sign(class)) (transition.state()) } }
}
