//! A card for each module: phase, lag, age of samples and status, journal, and its components.

use maud::{Markup, html};
use names::StructureName;
use observer::LiveModule;
use wire::{JournalStatus, ModuleStatus};
use wording::{NOTHING, printable, span, until};

use super::trouble::troubles;
use crate::drawing::title;
use crate::look;
use crate::view::View;

/// The modules of every structure.
pub(super) fn cards(view: &View<'_>) -> Markup {
    let structures = view.structures();
    html! {
        @for structure in &structures {
            @if structures.len() > 1 { h3 { (structure.map_or("of no known structure", StructureName::as_str)) } }
            div.cards { @for module in view.modules(*structure) { (card(view, module)) } }
        }
        @if structures.is_empty() { p.nothing { "No module answers." } }
    }
}

fn card(view: &View<'_>, module: &LiveModule) -> Markup {
    let member = &module.picture.member;
    let structure = member.structure.as_ref();
    let class = troubles(module).first().map_or("normal", |trouble| look::tone_class(trouble.tone));
    let drawn =
        structure.is_some_and(|name| view.drawing.is_some_and(|drawing| drawing.is_of(name)));
    html! {
        article.card.(class) {
            header {
                (heading(view, &html! { a href=(view.module(structure, &member.module)) { (member.module) } }))
                (look::phase(module))
            }
            (facts(view, module))
            @if !drawn { (components(view, module)) }
        }
    }
}

/// Below that of its structure, if there is one.
fn heading(view: &View<'_>, words: &Markup) -> Markup {
    html! { @if view.structures().len() > 1 { h4 { (words) } } @else { h3 { (words) } } }
}

/// What a module reports of itself; what it reported last, if it is not heard.
pub(crate) fn facts(view: &View<'_>, module: &LiveModule) -> Markup {
    let Some(status) = &module.picture.member.status else {
        return html! { p.nothing { "It has reported no status." } };
    };
    let silent = module.silent_since_unix_ns.is_some();
    let of = |ms: Option<f64>| ms.filter(|_| !silent).map_or_else(|| NOTHING.to_owned(), span);
    html! {
        dl.facts {
            div { dt { "verified" } dd { (module.picture.verified()) " of " (module.picture.components.len()) } }
            div { dt { "lag" } dd { (of(status.lag_ms)) } }
            div { dt { "age of samples" } dd { (of(status.sample_age_ms)) } }
            div { dt { "age of status" } dd { (age(view, status)) } }
            div { dt { "journal" } dd { (journal(&status.journal)) } }
            div { dt { "set aside" } dd { (status.shelved) } }
        }
        @if let Some(suppressed) = &status.suppressed {
            p.aside-note { "suppressed " (until(suppressed)) }
        }
    }
}

/// A status comes once a second: as long as it does, its age is of no interest.
#[expect(clippy::cast_precision_loss, reason = "ages are short")]
fn age(view: &View<'_>, status: &ModuleStatus) -> String {
    match view.scene.time_unix_ns.saturating_sub(status.time_unix_ns) {
        0..2_000_000_000 => "current".to_owned(),
        age => span((age / 1_000_000_000 * 1000) as f64),
    }
}

fn journal(journal: &JournalStatus) -> String {
    match (&journal.problem, &journal.directory) {
        (Some(problem), _) => format!("NOT WRITTEN: {}", printable(problem)),
        (None, None) => "none is kept".to_owned(),
        (None, Some(_)) if journal.unsaved > 0 => format!("{} records wait", journal.unsaved),
        (None, Some(_)) => format!("written, {} kB", journal.bytes / 1000),
    }
}

/// The components as signs with their names: the drawing of a module of which there is none.
pub(crate) fn components(view: &View<'_>, module: &LiveModule) -> Markup {
    let structure = module.picture.member.structure.as_ref();
    html! {
        ul.chips {
            @for component in &module.picture.components {
                li {
                    a.chip.(look::classes(component)) href=(view.component(structure, &component.component))
                        title=(title(component)) {
                        (look::sign(look::class(component)))
                        span { (component.component.component.name()) }
                        span.hidden { " " (component.state()) }
                    }
                }
            }
        }
    }
}
