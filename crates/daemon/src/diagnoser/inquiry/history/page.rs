//! From the index to a page.

use vocabulary::{
    FaultTransition, HistoryPage, HistoryQuestion, Identification, MAX_MESSAGE_BYTES, Message,
};

use super::index::Index;
use diagnosis::messages::Speaker;

/// A page is ended before it gets longer than this.
pub(super) const PAGE_BYTES: usize = MAX_MESSAGE_BYTES / 2;

/// Entries by their places, each with the number that the index has for it.
pub(super) trait Contents<P> {
    /// Why an entry cannot be had.
    type Error;

    fn transition(&mut self, sequence: u64, place: P) -> Result<FaultTransition, Self::Error>;

    fn identification(&mut self, sequence: u64, place: P) -> Result<Identification, Self::Error>;
}

/// The page that is asked for. Of the entries, those on it are read, and those that it ends before.
pub(super) fn compile<P: Copy, E: Contents<P>>(
    speaker: &Speaker,
    index: &Index<P>,
    question: HistoryQuestion,
    entries: &mut E,
) -> Result<HistoryPage, E::Error> {
    let mut page = HistoryPage {
        structure: speaker.structure.clone(),
        module: speaker.module.clone(),
        transitions: Vec::new(),
        identifications: Vec::new(),
        first_sequence: index.first_sequence(),
        next_sequence: index.next_sequence(),
        more: false,
    };
    let mut filled = Filled::default();
    let mut from = question.since;
    for &(sequence, place) in index.transitions_since(question.since) {
        page.more = page.transitions.len() as u64 == question.limit;
        if page.more {
            break;
        }
        let transition = entries.transition(sequence, place)?;
        let mut found = Vec::new();
        page.more = !filled.takes(&transition);
        if !page.more {
            let places = index.identifications(from, sequence);
            page.more = !filled.take_identifications(places, entries, &mut found)?;
        }
        if page.more {
            break;
        }
        page.transitions.push(transition);
        page.identifications.append(&mut found);
        filled.transitions += 1;
        from = sequence.saturating_add(1);
    }
    Ok(page)
}

/// How far a page is filled.
#[derive(Debug, Default)]
struct Filled {
    transitions: usize,
    transition_bytes: usize,
    bytes: usize,
}

impl Filled {
    /// Is there room for another transition?
    fn takes(&mut self, transition: &FaultTransition) -> bool {
        let length = length(transition);
        self.transition_bytes += length;
        self.bytes += length;
        self.transition_bytes <= PAGE_BYTES
    }

    /// Reads what belongs to a transition. Returns false if the page gets too long with it. The page keeps its first
    /// transition, with as much as there is room for, or the next page would be the same.
    fn take_identifications<P, E: Contents<P>>(
        &mut self,
        places: impl Iterator<Item = (u64, P)>,
        entries: &mut E,
        found: &mut Vec<Identification>,
    ) -> Result<bool, E::Error> {
        let is_first = self.transitions == 0;
        let mut room = PAGE_BYTES;
        for (sequence, place) in places {
            if !is_first && self.bytes > PAGE_BYTES {
                break;
            }
            let identification = entries.identification(sequence, place)?;
            let length = length(&identification);
            self.bytes += length;
            room = room.saturating_sub(length);
            if room == 0 {
                break;
            }
            found.push(identification);
        }
        Ok(is_first || self.bytes <= PAGE_BYTES)
    }
}

pub(super) fn length<M: Message>(message: &M) -> usize {
    vocabulary::encode(message).map_or(0, |text| text.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    use super::super::straightforward;
    use crate::diagnoser::state::Entry;

    fn speaker() -> Speaker {
        Speaker::of("t".parse().unwrap(), "m1".parse().unwrap())
    }

    /// Entries by their number in the order of a journal, and how many were read.
    struct Listed {
        entries: Vec<Entry>,
        read: usize,
    }

    impl Listed {
        fn new(entries: impl Iterator<Item = Entry>) -> (Self, Index<usize>) {
            let (entries, mut index): (Vec<Entry>, _) = (entries.collect(), Index::new());
            for (place, entry) in entries.iter().enumerate() {
                index.enter(entry, place);
            }
            (Self { entries, read: 0 }, index)
        }
    }

    impl Contents<usize> for Listed {
        type Error = Infallible;

        fn transition(&mut self, _: u64, place: usize) -> Result<FaultTransition, Infallible> {
            self.read += 1;
            let Entry::Transition(transition) = &self.entries[place] else { unreachable!() };
            Ok((**transition).clone())
        }

        fn identification(&mut self, _: u64, place: usize) -> Result<Identification, Infallible> {
            self.read += 1;
            let Entry::Identification(found) = &self.entries[place] else { unreachable!() };
            Ok((**found).clone())
        }
    }

    fn compile(
        speaker: &Speaker,
        all: impl Iterator<Item = Entry>,
        question: HistoryQuestion,
    ) -> HistoryPage {
        let (mut listed, index) = Listed::new(all);
        let Ok(page) = super::compile(speaker, &index, question, &mut listed);
        let entries = listed.entries.into_iter();
        assert_eq!(page, straightforward::compile(speaker, entries, question));
        page
    }

    #[test]
    fn all_pages_together_read_each_entry_at_most_twice() {
        let found = (0..9000).map(|as_of| found(as_of % 3000 + 1, as_of));
        let (mut listed, index) = Listed::new(transitions(3000).chain(found));
        for limit in [1, 7, 500] {
            let (mut since, mut shown) = (1, 0);
            listed.read = 0;
            loop {
                let question = HistoryQuestion { since, limit };
                let Ok(page) = super::compile(&speaker(), &index, question, &mut listed);
                shown += page.transitions.len() + page.identifications.len();
                let Some(last) = page.transitions.last().filter(|_| page.more) else { break };
                since = last.sequence + 1;
            }
            assert_eq!(shown, 12_000);
            assert!(listed.read <= 2 * shown, "{} reads of {shown} with {limit}", listed.read);
        }
    }

    fn transition(sequence: u64) -> Entry {
        let component = "sensor/g1".parse().unwrap();
        let untouched = speaker().untouched(&component, 0);
        Entry::Transition(Box::new(FaultTransition { sequence, ..untouched }))
    }

    fn transitions(count: u64) -> impl Iterator<Item = Entry> {
        (1..=count).map(transition)
    }

    fn found(sequence: u64, as_of: u64) -> Entry {
        let kind = vocabulary::fault::FaultKind::Bias;
        let size = diagnosis::identification::Size { value: 1.0 / 3.0, low: 0.1, high: 2.0 / 3.0 };
        let candidate =
            diagnosis::identification::Candidate { kind, probability: 0.1, size: Some(size) };
        let found = diagnosis::identification::Identification {
            run: vocabulary::RunId(1),
            sequence,
            component: "sensor/g1".parse().unwrap(),
            as_of: vocabulary::Step(as_of),
            candidates: vec![candidate; 5],
            signature: Vec::new(),
        };
        Entry::Identification(Box::new(speaker().identification(found, 0)))
    }

    #[test]
    fn identifications_are_on_the_page_of_the_transition_that_declared_the_fault() {
        let all = || {
            let late = [found(2, 50), found(3, 60), found(2, 70), found(5, 80)];
            transitions(5).chain(late)
        };
        let on_page = |since, limit| {
            let page = compile(&speaker(), all(), HistoryQuestion { since, limit });
            let found = page.identifications.iter().map(|found| found.as_of_step.0);
            found.collect::<Vec<_>>()
        };
        assert_eq!(on_page(1, 2), [50, 70]);
        assert_eq!(on_page(3, 2), [60]);
        assert_eq!(on_page(5, 2), [80]);
        assert_eq!(on_page(1, 500), [50, 70, 60, 80]);
    }

    #[test]
    fn an_identification_whose_transition_is_gone_is_on_the_page_after_it() {
        let all = [transition(7), found(5, 50)].into_iter();
        let page = compile(&speaker(), all, HistoryQuestion::since(1));
        assert_eq!(page.identifications.len(), 1);
    }

    #[test]
    fn of_a_fault_that_is_identified_ever_anew_the_latest_are_shown_and_pages_go_on() {
        let all = || {
            let found = (0..5000).map(|as_of| found(as_of % 300 + 1, as_of));
            transitions(300).chain(found)
        };
        let (mut since, mut numbers, mut shown) = (1, Vec::new(), 0);
        loop {
            let page = compile(&speaker(), all(), HistoryQuestion { since, limit: 500 });
            assert!(length(&page) < MAX_MESSAGE_BYTES);
            numbers.extend(page.transitions.iter().map(|transition| transition.sequence));
            shown += page.identifications.len();
            if !page.more {
                break;
            }
            since = numbers.last().unwrap() + 1;
        }
        assert_eq!(numbers, (1..=300).collect::<Vec<_>>());
        assert_eq!(shown, 5000);
        let many = std::iter::once(transition(1)).chain((0..100).map(|as_of| found(1, as_of)));
        let page = compile(&speaker(), many, HistoryQuestion::since(1));
        let steps: Vec<u64> = page.identifications.iter().map(|found| found.as_of_step.0).collect();
        assert_eq!(steps, (68..100).collect::<Vec<_>>());
    }

    #[test]
    fn pages_follow_each_other_without_a_gap() {
        let mut since = 1;
        let mut read_back = Vec::new();
        loop {
            let question = HistoryQuestion { since, limit: 7 };
            let page = compile(&speaker(), transitions(20), question);
            assert_eq!((page.first_sequence, page.next_sequence), (Some(1), 21));
            read_back.extend(page.transitions.iter().map(|t| t.sequence));
            if !page.more {
                break;
            }
            since = read_back.last().unwrap() + 1;
        }
        assert_eq!(read_back, (1..=20).collect::<Vec<_>>());
    }

    #[test]
    fn a_page_is_never_longer_than_a_message_may_be() {
        let page =
            compile(&speaker(), transitions(5000), HistoryQuestion { since: 1, limit: 5000 });
        assert!(page.more && !page.transitions.is_empty());
        assert!(vocabulary::encode(&page).unwrap().len() < MAX_MESSAGE_BYTES);
    }

    #[test]
    fn an_empty_journal_has_an_empty_page() {
        let page = compile(&speaker(), transitions(0), HistoryQuestion::since(1));
        assert_eq!((page.first_sequence, page.next_sequence, page.more), (None, 1, false));
    }
}
