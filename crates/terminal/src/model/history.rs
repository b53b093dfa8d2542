//! A component's history, as its module's journal has it.

use observer::{ComponentId, EventLine, Journals, ModuleHistory};

use super::close_up::Fetched;

/// What the journal holds of a component, the latest first.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ComponentHistory {
    pub(crate) subject: ComponentId,
    /// Each with its number.
    pub(crate) entries: Fetched<Vec<(u64, EventLine)>>,
    /// What is missing from it, if anything is.
    pub(crate) lacks: Option<String>,
    /// Rows that are scrolled over.
    pub(crate) place: usize,
}

impl ComponentHistory {
    pub(crate) fn new(subject: ComponentId) -> Self {
        Self { subject, entries: Fetched::Awaited, lacks: None, place: 0 }
    }

    pub(crate) fn take(&mut self, history: &ModuleHistory) {
        let notes = history.notes().join("; ");
        self.lacks = Some(notes.clone()).filter(|notes| !notes.is_empty());
        if !history.answered() {
            self.entries = Fetched::Missing(notes);
            return;
        }
        let entries = Journals::merge([history]).entries;
        let own = entries.iter().filter(|entry| *entry.component() == self.subject.component);
        self.entries =
            Fetched::Here(own.rev().map(|entry| (entry.sequence(), entry.line())).collect());
    }

    pub(crate) fn step(&mut self, by: isize) {
        let Fetched::Here(entries) = &self.entries else { return };
        let last = entries.len().saturating_sub(1);
        self.place = self.place.saturating_add_signed(by).min(last);
    }
}
