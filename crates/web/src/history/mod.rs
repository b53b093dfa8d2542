//! The merged journals of the modules, with filters in the URL so that a selection can be linked.
//!
//! | file | what |
//! |---|---|
//! | `filter` | parses the filters |
//! | `table` | transitions and identifications, latest first |

mod filter;
mod table;

use std::sync::Arc;

use axum::extract::{Query, State};
use axum::http::StatusCode;
use axum::response::Response;
use futures_util::future::join_all;
use maud::{Markup, html};
use observer::{JournalEntry, ModuleHistory};
use vocabulary::ComponentPath;
use vocabulary::words::printable;

use crate::access::Viewer;
use crate::app::Shared;
use crate::layout::Page;
use crate::view::LinkedScene;
use filter::{HistoryFilter, HistoryParameters};

/// Most entries on a page.
const MOST: usize = 500;
/// Most entries on a component's page.
const MOST_OF_COMPONENT: usize = 60;

/// `/history`
pub(crate) async fn page(
    State(app): State<Shared>,
    Query(asked): Query<HistoryParameters>,
    viewer: Viewer,
) -> Response {
    let scene = app.observed.scene();
    let view = LinkedScene::new(&scene);
    let page = Page {
        title: "History",
        place: "/history",
        live: String::new(),
        viewer: &viewer,
        scene: &scene,
    };
    match asked.filter() {
        Ok(filter) => {
            let wanted = scene.modules.iter().filter(|module| filter.wants_module(module));
            let journals = join_all(wanted.map(|module| app.observed.journal(module))).await;
            let journals: Vec<_> = journals.into_iter().flatten().collect();
            page.respond(&main(&view, &asked, &filter, &journals))
        }
        Err(problem) => page.refusing(
            StatusCode::BAD_REQUEST,
            &html! {
                h1 { "History" }
                (asked.form(&view))
                p.trouble.latched role="alert" { (printable(&problem)) }
            },
        ),
    }
}

fn main(
    view: &LinkedScene<'_>,
    asked: &HistoryParameters,
    filter: &HistoryFilter,
    journals: &[Arc<ModuleHistory>],
) -> Markup {
    let histories = || journals.iter().map(Arc::as_ref);
    html! {
        h1 { "History" }
        p { "The modules' journals, newest first." }
        (asked.form(view))
        (remarks(histories()))
        @if journals.is_empty() { p.nothing { "No module whose journal could be read is known." } }
        @else { (entries(view, histories(), |entry| filter.wants(entry))) }
    }
}

/// The entries of a component in its module's journal.
pub(crate) fn of_component(
    view: &LinkedScene<'_>,
    journal: &ModuleHistory,
    component: &ComponentPath,
) -> Markup {
    let own = |entry: &JournalEntry<'_>| entry.concerns(component);
    html! {
        (remarks([journal]))
        (table::table(view, [journal], own, MOST_OF_COMPONENT))
    }
}

/// The entries of several journals that are wanted.
pub(crate) fn entries<'a>(
    view: &LinkedScene<'_>,
    journals: impl IntoIterator<Item = &'a ModuleHistory>,
    wanted: impl Fn(&JournalEntry<'_>) -> bool,
) -> Markup {
    table::table(view, journals, wanted, MOST)
}

/// Gaps in the journals.
fn remarks<'a>(journals: impl IntoIterator<Item = &'a ModuleHistory>) -> Markup {
    let mut notes = Vec::new();
    for journal in journals {
        let ModuleHistory { module, since, .. } = journal;
        notes.extend(journal.notes());
        notes.extend((*since > 1).then(|| {
            format!("{module}: transitions before {since} are not shown here; `trusswatch history` shows all")
        }));
    }
    html! {
        @if !notes.is_empty() { ul.notes { @for note in &notes { li { (printable(note)) } } } }
    }
}
