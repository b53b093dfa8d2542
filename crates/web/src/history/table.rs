//! Transitions and identifications, latest first.

use maud::{Markup, html};
use observer::{JournalEntry, Journals, ModuleHistory};
use vocabulary::words::or_nothing;

use crate::look;
use crate::view::LinkedScene;

/// The columns, and whether they are numeric.
const COLUMNS: [(&str, bool); 6] = [
    ("time", false),
    ("number", true),
    ("component", false),
    ("state", false),
    ("step", true),
    ("why", false),
];

/// The selected entries of these journals, at most `most`.
pub(super) fn table<'a>(
    view: &LinkedScene<'_>,
    journals: impl IntoIterator<Item = &'a ModuleHistory>,
    wanted: impl Fn(&JournalEntry<'_>) -> bool,
    most: usize,
) -> Markup {
    let mut entries = Journals::merge(journals).entries;
    entries.retain(|entry| wanted(entry));
    entries.reverse();
    let left_out = entries.len().saturating_sub(most);
    html! {
        @if entries.is_empty() { p.nothing { "No entry." } }
        @else {
            div.wide tabindex="0" role="region" aria-label="Entries" {
                table.history {
                    thead { tr {
                        @for (name, is_number) in COLUMNS {
                            th.number[is_number] scope="col" { (name) }
                        }
                    } }
                    tbody { @for entry in entries.iter().take(most) { (row(view, entry)) } }
                }
            }
            @if left_out > 0 { p.note { (left_out) " earlier entries are left out: narrow the time." } }
        }
    }
}

fn row(view: &LinkedScene<'_>, entry: &JournalEntry<'_>) -> Markup {
    let line = entry.line();
    let structure = line.structure.as_ref();
    let href = match entry.component() {
        Some(component) => view.component(structure, component),
        None => view.module(structure, entry.module()),
    };
    html! {
        tr {
            td { (look::when(line.time_unix_ns)) }
            td.number { (or_nothing(entry.sequence())) }
            th scope="row" { a href=(href) { (line.who) } }
            td { (look::event(&line)) }
            td.number { (or_nothing(line.step)) }
            td { (line.why) }
        }
    }
}
