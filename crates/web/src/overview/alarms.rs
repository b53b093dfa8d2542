//! Alarms by urgency.

use maud::{Markup, html};
use observer::{Belonging, StateRow, Urgency, alarms};
use vocabulary::ComponentPath;

use crate::access::Person;
use crate::look;
use crate::view::LinkedScene;

/// Alarms that require an operator to act.
pub(crate) fn urgent(view: &LinkedScene<'_>) -> Markup {
    let mut rows = alarms(&view.scene.modules);
    rows.retain(|row| row.urgency.needs_attention());
    let nothing = if view.scene.modules.is_empty() {
        "Nothing is known."
    } else {
        "No active alarms among reporting modules."
    };
    html! {
        @if rows.is_empty() { p.nothing { (nothing) } } @else { (list(view, &rows)) }
    }
}

/// Shelved, suppressed, explained and recent changes, which are never hidden.
pub(crate) fn others(view: &LinkedScene<'_>) -> Markup {
    let mut rows = alarms(&view.scene.modules);
    rows.retain(|row| !row.urgency.needs_attention());
    html! {
        @if !rows.is_empty() {
            h3 { "Shelved, suppressed, explained or tentative" }
            (list(view, &rows))
        }
    }
}

/// Components and modules with all details of their states.
pub(crate) fn list(view: &LinkedScene<'_>, rows: &[StateRow]) -> Markup {
    html! { ol.list { @for row in rows { (line(view, row)) } } }
}

fn line(view: &LinkedScene<'_>, row: &StateRow) -> Markup {
    html! {
        li.alarm.(look::classes(row)) {
            (look::state(row))
            a.what href=(href(view, row)) { (row.name()) }
            @if !row.kind.is_empty() { span.kind { (row.kind) } }
            @if let Some(name) = to_acknowledge(row) {
                span.acknowledge {
                    input type="checkbox" name="component" value=(name) form=(SEVERAL)
                        aria-label={ "Select " (row.name()) };
                    button type="submit" name="only" value=(name) form=(SEVERAL) { "Acknowledge" }
                }
            }
            @if let Some(since) = row.since_unix_ns {
                p.meta {
                    (look::when(since))
                }
            }
            @if !row.why.is_empty() { p.why { (row.why) } }
            @for group in &row.groups {
                p.those {
                    @if group.belonging != Belonging::NotMonitored { (group.heading()) ": " }
                    @for path in &group.components {
                        a href=(view.component(row.structure.as_ref(), path)) { (short(row, path)) } " "
                    }
                }
            }
        }
    }
}

/// The id of the form that submits the list's buttons and check boxes. It is not part of the live content. Users who may
/// not send orders have no such form, and the style sheet hides the buttons.
pub(super) const SEVERAL: &str = "several";

/// The name under which the form acknowledges a row's fault, if it waits for that.
fn to_acknowledge(row: &StateRow) -> Option<String> {
    let path = row.component.as_ref().filter(|_| row.urgency == Urgency::Latched)?;
    Some(row.structure.as_ref().map_or_else(|| path.to_string(), |of| format!("{of}/{path}")))
}

/// Acknowledges the selected faults.
pub(super) fn acknowledge_selected(person: &Person) -> Markup {
    html! {
        form #(SEVERAL) method="post" action="/order/acknowledge" {
            input type="hidden" name="token" value=(person.form_token);
            input type="hidden" name="back" value="/";
            label { "Note" input type="text" name="note" maxlength="500" autocomplete="off"; }
            button type="submit" { "Acknowledge the selected" }
        }
    }
}

/// A component's name, with its module if that is another one than the row's.
fn short(row: &StateRow, path: &ComponentPath) -> String {
    if path.module == row.module { path.component.name().to_owned() } else { path.to_string() }
}

/// The link to the page of a component or a module.
pub(crate) fn href(view: &LinkedScene<'_>, row: &StateRow) -> String {
    match &row.component {
        Some(path) => view.component(row.structure.as_ref(), path),
        None => view.module(row.structure.as_ref(), &row.module),
    }
}
