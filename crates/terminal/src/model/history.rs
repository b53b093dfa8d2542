//! A component's history, from its module's journal.

use observer::{ComponentId, EventLine, Journals, ModuleHistory};

use super::close_up::Fetched;

/// The entries of a component in the journal, latest first.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ComponentHistory {
    pub(crate) subject: ComponentId,
    /// Each entry with its sequence number.
    pub(crate) entries: Fetched<Vec<(Option<u64>, EventLine)>>,
    /// Gaps in the journal, if any.
    pub(crate) lacks: Option<String>,
    /// Number of rows scrolled past.
    pub(crate) place: usize,
}

impl ComponentHistory {
    pub(crate) fn new(subject: ComponentId) -> Self {
        Self { subject, entries: Fetched::Awaited, lacks: None, place: 0 }
    }

    pub(crate) fn accept(&mut self, history: &ModuleHistory) {
        let notes = history.notes().join("; ");
        self.lacks = Some(notes.clone()).filter(|notes| !notes.is_empty());
        if !history.answered() {
            self.entries = Fetched::Missing(notes);
            return;
        }
        let entries = Journals::merge([history]).entries;
        let own = entries.iter().filter(|entry| entry.concerns(&self.subject.component));
        self.entries =
            Fetched::Here(own.rev().map(|entry| (entry.sequence(), entry.line())).collect());
    }

    pub(crate) fn step(&mut self, by: isize) {
        let Fetched::Here(entries) = &self.entries else { return };
        let last = entries.len().saturating_sub(1);
        self.place = self.place.saturating_add_signed(by).min(last);
    }
}
