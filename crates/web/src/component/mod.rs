//! The page of a component: state with reasons, evidence, history.
//!
//! | file | what |
//! |---|---|
//! | `shown` | the parts of the page that change |
//! | `facts` | the state with reasons, the measurements, the kind of fault |
//! | `trail` | which change explains which, drawn |
//! | `margins` | how near it is to its limits, and the trends |
//! | `plot` | residual and divergence of at most a minute |
//! | `evidence` | journal and freeze frame, fetched from the module |
//! | `watch` | keeps the page up to date while it is viewed |

mod evidence;
mod facts;
pub(crate) mod margins;
mod plot;
mod shown;
mod trail;
mod watch;

use std::sync::Arc;

use axum::extract::{Path, Query, State};
use axum::response::Response;
use maud::{Markup, PreEscaped, html};
use observer::{ComponentId, title};
use vocabulary::{ComponentPath, FaultTransition};

use crate::access::Viewer;
use crate::app::Shared;
use crate::forms;
use crate::layout::{Page, unknown};
use crate::live_page::{LivePage, PageParameters};
use crate::view::LinkedScene;
use evidence::ModuleAnswers;
use shown::Shown;

pub(crate) use watch::ComponentWatch;

/// `/component/{module}/{kind}/{name}`
pub(crate) async fn page(
    State(app): State<Shared>,
    Path((module, kind, name)): Path<(String, String, String)>,
    Query(parameters): Query<PageParameters>,
    viewer: Viewer,
) -> Response {
    let scene = app.observed.scene();
    let parsed = format!("{module}/{kind}/{name}").parse::<ComponentPath>();
    let found = parsed.map_err(|error| error.to_string()).and_then(|name| {
        let found = scene.component(parameters.structure()?.as_ref(), &name);
        found.ok_or_else(|| format!("nothing is known of `{name}`"))
    });
    let transition = match found {
        Ok(transition) => transition,
        Err(problem) => return unknown(&viewer, &scene, &problem),
    };
    let view = LinkedScene::new(&scene);
    let evidence = ModuleAnswers::fetch(&app.observed, &scene, transition).await;
    let live = app.observed.traces(&transition.structure, &transition.module);
    let traces = Arc::clone(&live.borrow());
    let shown = Shown { view: &view, transition, evidence: &evidence, traces: &traces };
    let page = Page {
        title: &title(transition),
        place: "",
        live: LivePage::Component(ComponentId::of(transition)).parameters(),
        viewer: &viewer,
        scene: &scene,
    };
    let place = app
        .drawing
        .as_ref()
        .map(|drawing| drawing.place(&view, Some(&transition.structure), &transition.component));
    page.respond(&main(&shown, &viewer, place.as_ref()))
}

fn main(shown: &Shown<'_>, viewer: &Viewer, place: Option<&Markup>) -> Markup {
    let FaultTransition { component, structure, module, .. } = shown.transition;
    let parts = shown.parts();
    let slot = |id: &'static str| {
        let html = parts.iter().find(|part| part.id == id).map_or("", |part| part.html.as_str());
        html! { div id=(id) { (PreEscaped(html)) } }
    };
    let history = format!("/history?module={module}&component={component}");
    html! {
        nav.trace aria-label="Place" {
            a href="/" { (structure) } " / " a href=(shown.view.module(Some(structure), module)) { (module) }
        }
        h1 { (component) }
        (slot("summary"))
        (forms::of_component(viewer, shown.transition, &shown.view.component(Some(structure), component)))
        (slot("facts"))
        @if let Some(place) = place { section.place { h2 { "Where it is" } (place) } }
        section { h2 { "What explains what" } (slot("trail")) }
        section { h2 { "Around the onset" } (slot("frame")) }
        section { h2 { "How near to its limits" } (slot("margins")) }
        section { h2 { "Residual and divergence, as published" } (slot("plot")) }
        section { h2 { "History" } (slot("journal")) p { a href=(history) { "With filters" } } }
    }
}
