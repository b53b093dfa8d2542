//! A component's history, as its module's journal has it.

use observer::{EventLine, Journals, ModuleHistory};

use super::close_up::Had;
use super::subject::Subject;

/// What the journal holds of a component, the latest first.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Journal {
    pub(crate) subject: Subject,
    /// Each with its number.
    pub(crate) entries: Had<Vec<(u64, EventLine)>>,
    /// What is missing from it, if anything is.
    pub(crate) lacks: Option<String>,
    /// Rows that are scrolled over.
    pub(crate) place: usize,
}

impl Journal {
    pub(crate) fn new(subject: Subject) -> Self {
        Self { subject, entries: Had::Awaited, lacks: None, place: 0 }
    }

    pub(crate) fn take(&mut self, history: &ModuleHistory) {
        let notes = history.notes().join("; ");
        self.lacks = Some(notes.clone()).filter(|notes| !notes.is_empty());
        if !history.answered() {
            self.entries = Had::Missing(notes);
            return;
        }
        let entries = Journals::merge([history]).entries;
        let own = entries.iter().filter(|entry| *entry.component() == self.subject.component);
        self.entries = Had::Here(own.rev().map(|entry| (entry.sequence(), entry.line())).collect());
    }

    pub(crate) fn step(&mut self, by: isize) {
        let Had::Here(entries) = &self.entries else { return };
        let last = entries.len().saturating_sub(1);
        self.place = self.place.saturating_add_signed(by).min(last);
    }
}
