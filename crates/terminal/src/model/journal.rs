//! A component's history, as its module's journal has it.

use observer::ModuleHistory;
use wire::FaultTransition;
use wording::printable;

use super::close_up::Had;
use super::subject::Subject;

/// The transitions of a component, the latest first.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Journal {
    pub(crate) subject: Subject,
    pub(crate) transitions: Had<Vec<FaultTransition>>,
    /// What is missing from it, if anything is.
    pub(crate) lacks: Option<String>,
    /// Rows that are scrolled over.
    pub(crate) place: usize,
}

impl Journal {
    pub(crate) fn new(subject: Subject) -> Self {
        Self { subject, transitions: Had::Awaited, lacks: None, place: 0 }
    }

    pub(crate) fn take(&mut self, history: ModuleHistory) {
        self.lacks = lacks(&history);
        if !history.answered() {
            let why = self.lacks.take().unwrap_or_else(|| "its module does not answer".to_owned());
            self.transitions = Had::Missing(why);
            return;
        }
        let own = history.transitions.into_iter();
        let mut own: Vec<_> = own.filter(|one| one.component == self.subject.component).collect();
        own.reverse();
        self.transitions = Had::Here(own);
    }

    pub(crate) fn step(&mut self, by: isize) {
        let Had::Here(transitions) = &self.transitions else { return };
        let last = transitions.len().saturating_sub(1);
        self.place = self.place.saturating_add_signed(by).min(last);
    }
}

fn lacks(history: &ModuleHistory) -> Option<String> {
    let gaps: u64 = history.gaps(1).iter().map(|gap| gap.to - gap.from + 1).sum();
    if let Some(error) = &history.broken_off {
        return Some(format!("reading broke off: {}", printable(&error.to_string())));
    }
    if gaps > 0 {
        return Some(format!("{gaps} transitions of its module are missing"));
    }
    let first = history.first_sequence.filter(|first| *first > 1)?;
    Some(format!("older than the journal: the first {} transitions of its module", first - 1))
}
