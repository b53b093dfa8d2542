//! The page of a module: components, status, journal, peers.

use axum::extract::{Path, Query, State};
use axum::response::Response;
use maud::{Markup, PreEscaped, html};
use observer::trend::TrendSpan;
use observer::{ModuleId, ModuleView, rows};
use vocabulary::words::{NOTHING, printable};
use vocabulary::{Component, ComponentPath, FaultTransition, ModuleName, ModuleStatus, PeerStatus};

use crate::access::Viewer;
use crate::app::Shared;
use crate::component::margins::{NAMES, drawing_of_module, forecasts, meter, words_of};
use crate::forms;
use crate::layout::{Page, not_reported, unknown};
use crate::live_page::{LivePage, PageParameters};
use crate::look;
use crate::overview::{alarms, modules};
use crate::part::{PagePart, part};
use crate::records::ModuleTrends;
use crate::view::LinkedScene;

/// The columns of the table of peers, and whether they are numeric.
const PEER_COLUMNS: [(&str, bool); 7] = [
    ("peer", false),
    ("presence", false),
    ("answered", true),
    ("refused", true),
    ("unanswered", true),
    ("disputed", true),
    ("latest refusal", false),
];

/// `/module/{name}`
pub(crate) async fn page(
    State(app): State<Shared>,
    Path(name): Path<String>,
    Query(parameters): Query<PageParameters>,
    viewer: Viewer,
) -> Response {
    let scene = app.observed.scene();
    let view = LinkedScene::new(&scene);
    let parsed = name.parse::<ModuleName>().map_err(|error| error.to_string());
    let found = parsed.and_then(|name| {
        let found = scene.module(parameters.structure()?.as_ref(), &name);
        found.ok_or_else(|| format!("nothing is known of a module `{name}`"))
    });
    match found {
        Ok(module) => {
            let title = title(&module.id());
            let live = LivePage::Module(module.id()).parameters();
            let page = Page { title: &title, place: "", live, viewer: &viewer, scene: &scene };
            let trends = match &module.structure {
                Some(structure) => app.observed.trends(structure, &module.module).await,
                None => None,
            };
            page.respond(&main(&view, &viewer, module, (trends.as_deref(), parameters.trend())))
        }
        Err(problem) => unknown(&viewer, &scene, &problem),
    }
}

/// What it shows.
pub(crate) fn title(id: &ModuleId) -> String {
    format!("Module {}", id.module)
}

/// The parts that change.
pub(crate) fn parts(view: &LinkedScene<'_>, id: &ModuleId) -> Vec<PagePart> {
    match view.scene.view_of(id) {
        Some(module) => vec![part("module", body(view, module))],
        None => vec![part("module", not_reported())],
    }
}

fn main(
    view: &LinkedScene<'_>,
    viewer: &Viewer,
    module: &ModuleView,
    (trends, span): (Option<&ModuleTrends>, TrendSpan),
) -> Markup {
    let back = view.module(module.structure.as_ref(), &module.module);
    html! {
        @if let Some(structure) = &module.structure {
            nav.trace aria-label="Place" { a href="/" { (structure) } }
        }
        h1 { (module.module) }
        div #module { (body(view, module)) }
        (coming_nearer(view, module, trends))
        (developed(module, &back, trends, span))
        (forms::of_module(viewer, module, &back))
        p { a href={ "/history?module=" (module.module) } { "What its journal holds" } }
    }
}

fn body(view: &LinkedScene<'_>, module: &ModuleView) -> Markup {
    let mut components = rows(std::slice::from_ref(module));
    components.retain(|row| row.component.is_some());
    html! {
        p.headline { (look::condition(module)) }
        (modules::facts(view, module))
        section {
            h2 { "Components" }
            @if components.is_empty() { p.nothing { "Their states are unknown." } }
            (alarms::list(view, &components))
        }
        @if let Some(status) = module.status.as_ref().filter(|_| !module.is_silent) {
            section { h2 { "How near to their limits" } (margins(view, module, status)) }
        }
        @if let Some(status) = &module.status { (peers(view, module, status)) (software(module, status)) }
    }
}

/// How near each component is to its limits at present.
fn margins(view: &LinkedScene<'_>, module: &ModuleView, status: &ModuleStatus) -> Markup {
    let path = |component: &Component| ComponentPath {
        module: module.module.clone(),
        component: component.clone(),
    };
    html! {
        div.wide tabindex="0" role="region" aria-label="Margins" { table.margins {
            thead { tr {
                th scope="col" { "component" }
                @for name in NAMES { th scope="col" { (name) } }
            } }
            tbody { @for margins in &status.margins { tr {
                th scope="row" {
                    a href=(view.component(module.structure.as_ref(), &path(&margins.component))) { (margins.component) }
                }
                @for (_, share) in margins.shares() { td { (meter(share)) } }
            } } }
        } }
        p.note { "Shares of the limits: at 1 a fault is found. Of the change, the largest of the last second." }
    }
}

/// The components that come nearer to a limit, with the date.
fn coming_nearer(
    view: &LinkedScene<'_>,
    module: &ModuleView,
    trends: Option<&ModuleTrends>,
) -> Markup {
    let of_one = |known: &'_ FaultTransition| {
        trends.map_or_else(Vec::new, |trends| forecasts(trends, &known.component.component))
    };
    let with_dates = module.components.iter().map(|known| (known, of_one(known)));
    let dated: Vec<_> = with_dates.filter(|(_, forecasts)| !forecasts.is_empty()).collect();
    html! {
        @if !dated.is_empty() {
            section {
                h2 { "Coming nearer to a limit" }
                ul.notes { @for (known, forecasts) in &dated { @for (test, forecast) in forecasts { li {
                    a href=(view.component(Some(&known.structure), &known.component)) { (known.component) }
                    ", " (test) ": " (forecast.words())
                } } } }
            }
        }
    }
}

/// How the components came nearer to their limits over a span, drawn.
fn developed(
    module: &ModuleView,
    page: &str,
    trends: Option<&ModuleTrends>,
    span: TrendSpan,
) -> Markup {
    let between = if page.contains('?') { '&' } else { '?' };
    html! {
        section #trends {
            h2 { "How they developed over the last " (words_of(span).0) }
            @match trends.filter(|trends| !trends.span(span).is_empty()) {
                None => p.nothing { "Nothing is kept of it: start the page with --state-dir." },
                Some(trends) => {
                    nav aria-label="Span" {
                        @for one in TrendSpan::ALL {
                            a href={ (page) (between) "trend=" (words_of(one).0) "#trends" }
                                aria-current=[(one == span).then_some("true")] { (words_of(one).0) }
                            " "
                        }
                    }
                    div.plot { (PreEscaped(drawing_of_module(&module.module, trends, span).svg())) }
                }
            }
        }
    }
}

/// The time of a report that a silent module made when it was last heard.
fn as_of(module: &ModuleView, status: &ModuleStatus) -> Markup {
    html! { @if module.is_silent { ", last reported at " (look::when(status.time_unix_ns)) } }
}

fn peers(view: &LinkedScene<'_>, module: &ModuleView, status: &ModuleStatus) -> Markup {
    let structure = module.structure.as_ref();
    let row = |peer: &PeerStatus| {
        html! {
            tr {
                th scope="row" { a href=(view.module(structure, &peer.module)) { (peer.module) } }
                td { @if peer.present { "there" } @else { "NOT THERE" } }
                td.number { (peer.answered) }
                td.number { (peer.refused) }
                td.number { (peer.timed_out + peer.absent) }
                td.number { (peer.disputed) }
                td { (peer.reason.as_ref().map_or_else(|| NOTHING.to_owned(), |reason| printable(reason))) }
            }
        }
    };
    html! {
        section {
            h2 { "Peers as seen by this module" (as_of(module, status)) }
            @if status.peers.is_empty() { p.nothing { "It has none." } }
            @else {
                div.wide tabindex="0" role="region" aria-label="Peers" { table {
                    thead { tr {
                        @for (name, is_number) in PEER_COLUMNS {
                            th.number[is_number] scope="col" { (name) }
                        }
                    } }
                    tbody { @for peer in &status.peers { (row(peer)) } }
                } }
            }
        }
    }
}

fn software(module: &ModuleView, status: &ModuleStatus) -> Markup {
    html! {
        section {
            h2 { "Set up with" (as_of(module, status)) }
            dl.facts {
                div { dt { "software" } dd { (printable(&status.software)) } }
                div { dt { "thresholds" } dd { (printable(&status.thresholds)) } }
                div { dt { "reference" } dd {
                    (status.reference.as_ref().map_or_else(|| "none: nothing is verified".to_owned(), |name| printable(name)))
                } }
                div { dt { "step" } dd { (vocabulary::words::or_nothing(status.step)) } }
                div { dt { "samples used" } dd { (status.diagnosis.samples) } }
                div { dt { "samples missing" } dd { (status.diagnosis.samples_missing) } }
            }
        }
    }
}
