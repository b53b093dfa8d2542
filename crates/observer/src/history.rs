//! A module's journal over the network, page by page.

use std::time::Duration;

use names::{ModuleName, StructureName};
use wire::{FaultTransition, HistoryPage, HistoryQuestion, Identification, Key, Topic};
use zenoh::Session;

use super::request::{QueryError, Question, ask, senseless};

/// What was read of a module's journal.
#[derive(Debug, Clone, PartialEq)]
pub struct ModuleHistory {
    /// The structure.
    pub structure: StructureName,
    /// The module.
    pub module: ModuleName,
    /// Transitions in the order of their sequence numbers.
    pub transitions: Vec<FaultTransition>,
    /// What was published of the kinds of the faults, those of each fault in their order.
    pub identifications: Vec<Identification>,
    /// The lowest sequence number that the journal still held; `None` if it held none.
    pub first_sequence: Option<u64>,
    /// The sequence number that the module's next transition will have; `None` if no page came.
    pub next_sequence: Option<u64>,
    /// Why reading ended before the journal did.
    pub broken_off: Option<QueryError>,
}

/// Sequence numbers that a journal should hold and does not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gap {
    /// The first that is missing.
    pub from: u64,
    /// The last that is missing.
    pub to: u64,
}

impl ModuleHistory {
    fn new(structure: &StructureName, module: &ModuleName) -> Self {
        Self {
            structure: structure.clone(),
            module: module.clone(),
            transitions: Vec::new(),
            identifications: Vec::new(),
            first_sequence: None,
            next_sequence: None,
            broken_off: None,
        }
    }

    /// Whether the module answered at all.
    #[must_use]
    pub fn answered(&self) -> bool {
        self.next_sequence.is_some()
    }

    /// Sequence numbers missing from `since` on. Those before the journal's first are no gap but were
    /// cut off; those after the point where reading broke off are not known.
    #[must_use]
    pub fn gaps(&self, since: u64) -> Vec<Gap> {
        let Some(first) = self.first_sequence else { return Vec::new() };
        let mut expected = first.max(since).max(1);
        let mut gaps = Vec::new();
        let end = self.next_sequence.filter(|_| self.broken_off.is_none());
        for sequence in self.transitions.iter().map(|t| t.sequence).chain(end) {
            if sequence > expected {
                gaps.push(Gap { from: expected, to: sequence - 1 });
            }
            expected = expected.max(sequence.saturating_add(1));
        }
        gaps
    }

    /// Takes a page; returns where the next one begins, if there is one.
    fn take(&mut self, asked: u64, page: HistoryPage) -> Result<Option<u64>, QueryError> {
        if page.structure != self.structure || page.module != self.module {
            let (structure, module) = (&page.structure, &page.module);
            return Err(senseless(format!("the page is of `{module}` of `{structure}`")));
        }
        let mut next = asked;
        for transition in &page.transitions {
            if transition.sequence < next {
                let sequence = transition.sequence;
                return Err(senseless(format!("sequence {sequence} comes where {next} is due")));
            }
            next = transition.sequence.saturating_add(1);
        }
        if page.more && page.transitions.is_empty() {
            return Err(senseless(format!("there is more from {asked} on, but the page is empty")));
        }
        self.first_sequence = self.first_sequence.or(page.first_sequence);
        self.next_sequence = Some(page.next_sequence);
        self.transitions.extend(page.transitions);
        self.identifications.extend(page.identifications);
        Ok(page.more.then_some(next))
    }
}

/// Reads a module's journal from the sequence number `since` on. Every page may take as long as
/// `timeout`. What was read before a page failed is kept.
pub async fn history(
    session: &Session,
    structure: &StructureName,
    module: &ModuleName,
    since: u64,
    timeout: Duration,
) -> ModuleHistory {
    let key = Key::of_module(structure, module, Topic::History);
    let mut history = ModuleHistory::new(structure, module);
    let mut next = Some(since);
    while let Some(asked) = next {
        let question = Question::of_parameters(HistoryQuestion::since(asked).to_parameters());
        let page = ask(session, &key, question, timeout).await;
        match page.and_then(|page| history.take(asked, page)) {
            Ok(following) => next = following,
            Err(error) => {
                history.broken_off = Some(error);
                return history;
            }
        }
    }
    history
}

#[cfg(test)]
mod tests {
    use super::*;

    fn structure() -> StructureName {
        "tower".parse().unwrap()
    }

    fn module() -> ModuleName {
        "m".parse().unwrap()
    }

    fn page(sequences: &[u64], more: bool) -> HistoryPage {
        let transition = |sequence: &u64| FaultTransition {
            sequence: *sequence,
            ..FaultTransition::untouched(structure(), "m/sensor/g1".parse().unwrap(), 0)
        };
        HistoryPage {
            structure: structure(),
            module: module(),
            transitions: sequences.iter().map(transition).collect(),
            identifications: Vec::new(),
            first_sequence: Some(3),
            next_sequence: 12,
            more,
        }
    }

    fn empty() -> ModuleHistory {
        ModuleHistory::new(&structure(), &module())
    }

    #[test]
    fn pages_follow_each_other_and_what_is_missing_is_reported() {
        let mut history = empty();
        assert!(!history.answered());
        assert_eq!(history.take(1, page(&[3, 4, 6], true)), Ok(Some(7)));
        assert_eq!(history.take(7, page(&[7, 8], false)), Ok(None));
        let gap = |from, to| Gap { from, to };
        assert_eq!(history.gaps(1), [gap(5, 5), gap(9, 11)]);
        assert_eq!(history.gaps(6), [gap(9, 11)]);
        history.broken_off = Some(QueryError::Unanswered(Duration::ZERO));
        assert_eq!(history.gaps(1), [gap(5, 5)], "after a break nothing is known of the end");
    }

    #[test]
    fn pages_that_would_never_end_or_are_anothers_are_refused() {
        for (asked, page) in [
            (7, page(&[6], true)),
            (1, page(&[3, 3], false)),
            (1, page(&[], true)),
            (1, HistoryPage { module: "n".parse().unwrap(), ..page(&[3], false) }),
        ] {
            assert!(matches!(empty().take(asked, page), Err(QueryError::Senseless(_))));
        }
    }
}
