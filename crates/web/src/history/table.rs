//! Transitions and kinds of faults, the latest first.

use maud::{Markup, html};
use names::ComponentPath;
use wire::{FaultTransition, Identification};
use wording::{NOTHING, identified, reason};

use crate::desk::Journal;
use crate::events::verdict_state;
use crate::look;
use crate::view::View;

/// The columns, and whether numbers stand in them.
const COLUMNS: [(&str, bool); 6] = [
    ("time", false),
    ("number", true),
    ("component", false),
    ("state", false),
    ("step", true),
    ("why", false),
];

/// Something that a journal holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Entry<'a> {
    Transition(&'a FaultTransition),
    Identification(&'a Identification),
}

impl<'a> Entry<'a> {
    pub(super) fn component(&self) -> &'a ComponentPath {
        match self {
            Entry::Transition(transition) => &transition.component,
            Entry::Identification(found) => &found.component,
        }
    }

    pub(super) fn time_unix_ns(&self) -> u64 {
        match self {
            Entry::Transition(transition) => transition.time_unix_ns,
            Entry::Identification(found) => found.time_unix_ns,
        }
    }

    /// Within one module the order of its transitions counts, whatever its clock says.
    fn sequence(&self) -> u64 {
        match self {
            Entry::Transition(transition) => transition.sequence,
            Entry::Identification(found) => found.sequence,
        }
    }
}

/// The wanted entries of these journals, no more than `most`.
pub(super) fn table(
    view: &View<'_>,
    journals: &[Journal],
    wanted: impl Fn(&Entry<'_>) -> bool,
    most: usize,
) -> Markup {
    let mut entries = entries(journals);
    entries.retain(|entry| wanted(entry));
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

fn entries(journals: &[Journal]) -> Vec<Entry<'_>> {
    let read = journals.iter().filter_map(|journal| journal.read.as_ref().ok());
    let mut entries: Vec<Entry<'_>> = read
        .flat_map(|history| {
            let transitions = history.transitions.iter().map(Entry::Transition);
            transitions.chain(history.identifications.iter().map(Entry::Identification))
        })
        .collect();
    entries.sort_by_key(|entry| std::cmp::Reverse((entry.time_unix_ns(), entry.sequence())));
    entries
}

fn row(view: &View<'_>, entry: &Entry<'_>) -> Markup {
    let structure = match entry {
        Entry::Transition(transition) => &transition.structure,
        Entry::Identification(found) => &found.structure,
    };
    let component = entry.component();
    html! {
        tr {
            td { (look::when(entry.time_unix_ns())) }
            td.number { (entry.sequence()) }
            th scope="row" { a href=(view.component(Some(structure), component)) { (component) } }
            @match entry {
                Entry::Transition(transition) => {
                    td { (verdict_state(transition)) }
                    td.number { (transition.decided_step.map_or_else(|| NOTHING.to_owned(), |step| step.to_string())) }
                    td { (reason(transition)) }
                },
                Entry::Identification(found) => {
                    td { "kind" }
                    td.number { (found.as_of_step) }
                    td { (identified(found)) }
                },
            }
        }
    }
}
