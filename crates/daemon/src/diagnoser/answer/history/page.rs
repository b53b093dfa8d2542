//! From the entries of a journal to a page: which entries there are, where each is, and which are on a page.

use std::collections::{BTreeMap, VecDeque};

use diagnosis::messages::Speaker;
use process::JournalRecord;
use vocabulary::{
    Component, FaultTransition, HistoryPage, HistoryQuestion, Identification,
    MAX_IDENTIFICATIONS_OF_FAULT, MAX_MESSAGE_BYTES, MAX_PHASE_CHANGES_ON_PAGE, Message,
    ModuleName, PhaseChange, Step,
};

/// A page is ended before it gets longer than this.
pub(super) const PAGE_BYTES: usize = MAX_MESSAGE_BYTES / 2;

/// Reads entries by their places, each with the number that the index has for it.
pub(super) trait EntryReader<P> {
    /// Why an entry cannot be had.
    type Error;

    fn transition(&mut self, sequence: u64, place: P) -> Result<FaultTransition, Self::Error>;

    fn identification(&mut self, sequence: u64, place: P) -> Result<Identification, Self::Error>;

    fn phase(&mut self, number: u64, place: P) -> Result<PhaseChange, Self::Error>;
}

/// The page that is asked for. Of the entries, those on it are read, and those that it ends before.
pub(super) fn compile<P: Copy, E: EntryReader<P>>(
    speaker: &Speaker,
    index: &HistoryIndex<P>,
    question: HistoryQuestion,
    entries: &mut E,
) -> Result<HistoryPage, E::Error> {
    let mut page = HistoryPage {
        structure: speaker.structure.clone(),
        module: speaker.module.clone(),
        transitions: Vec::new(),
        identifications: Vec::new(),
        phases: Vec::new(),
        first_sequence: index.first_sequence(),
        next_sequence: index.next_sequence(),
        more: false,
    };
    let mut filled = PageFill::default();
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
    let last = page.transitions.last().filter(|_| page.more).map(|last| last.sequence);
    for (number, place) in index.phases(question.since.saturating_sub(1), last) {
        page.phases.push(entries.phase(number, place)?);
    }
    Ok(page)
}

/// How far a page is filled.
#[derive(Debug, Default)]
struct PageFill {
    transitions: usize,
    transition_bytes: usize,
    bytes: usize,
}

impl PageFill {
    /// Is there room for another transition?
    fn takes(&mut self, transition: &FaultTransition) -> bool {
        let length = length(transition);
        self.transition_bytes += length;
        self.bytes += length;
        self.transition_bytes <= PAGE_BYTES
    }

    /// Reads what belongs to a transition. Returns false if the page gets too long with it. The page keeps its first
    /// transition, with as much as there is room for, or the next page would be the same.
    fn take_identifications<P, E: EntryReader<P>>(
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

/// Which entry of the journal is where. 24 bytes for each transition, which takes some hundred in the journal.
///
/// The places of the entries that pages can show.
#[derive(Debug)]
pub(super) struct HistoryIndex<P> {
    /// With their numbers, which ascend.
    transitions: Vec<(u64, P)>,
    /// The latest of each fault, by the number of the transition that declared it, in the order of their entry.
    identifications: BTreeMap<u64, VecDeque<P>>,
    /// With their numbers, and the number of the transition before each.
    phases: Vec<(u64, u64, P)>,
}

impl<P: Copy> HistoryIndex<P> {
    pub(super) fn new() -> Self {
        Self { transitions: Vec::new(), identifications: BTreeMap::new(), phases: Vec::new() }
    }

    /// Takes in the entries of a module in their order, each once.
    pub(super) fn enter(&mut self, entry: &HistoryEntry, place: P) {
        match entry {
            HistoryEntry::Transition(transition) => {
                self.transitions.push((transition.sequence, place))
            }
            HistoryEntry::Identification(found) => {
                let of_fault = self.identifications.entry(found.sequence).or_default();
                if of_fault.len() == MAX_IDENTIFICATIONS_OF_FAULT {
                    of_fault.pop_front();
                }
                of_fault.push_back(place);
            }
            HistoryEntry::Phase(change) => {
                let after = self.transitions.last().map_or(0, |(sequence, _)| *sequence);
                self.phases.push((after, change.number, place));
            }
        }
    }

    /// The latest changes of phase after the transition of the first number, and before that of the last.
    fn phases(&self, after: u64, before: Option<u64>) -> impl Iterator<Item = (u64, P)> {
        let place = |sequence| self.phases.partition_point(|(after, ..)| *after < sequence);
        let (from, to) = (place(after), before.map_or(self.phases.len(), place));
        let from = from.max(to.saturating_sub(MAX_PHASE_CHANGES_ON_PAGE));
        self.phases[from.min(to)..to].iter().map(|(_, number, place)| (*number, *place))
    }

    /// The number of the first transition, if there is any.
    pub(super) fn first_sequence(&self) -> Option<u64> {
        self.transitions.first().map(|(sequence, _)| *sequence)
    }

    /// The number that the next transition will have.
    pub(super) fn next_sequence(&self) -> u64 {
        self.transitions.last().map_or(1, |(sequence, _)| sequence.saturating_add(1))
    }

    /// The transitions from this number on, with their numbers.
    pub(super) fn transitions_since(&self, since: u64) -> &[(u64, P)] {
        let before = self.transitions.partition_point(|(sequence, _)| *sequence < since);
        &self.transitions[before..]
    }

    /// The identifications of faults declared by transitions of these numbers, with the numbers.
    pub(super) fn identifications(&self, first: u64, last: u64) -> impl Iterator<Item = (u64, P)> {
        let found = self.identifications.range(first..=last.max(first));
        found.flat_map(|(sequence, places)| places.iter().map(|place| (*sequence, *place)))
    }
}

/// What a page of history shows of a journal.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum HistoryEntry {
    /// A transition.
    Transition(Box<FaultTransition>),
    /// What was published of a fault.
    Identification(Box<Identification>),
    /// A change of the phase, or of the components that the module monitors.
    Phase(Box<PhaseChange>),
}

/// Of records, read one by one, the entries of a module, each once.
#[derive(Debug)]
pub(super) struct HistoryEntries {
    module: ModuleName,
    seen: SeenEntries,
}

impl HistoryEntries {
    pub(super) fn of(module: &ModuleName) -> Self {
        Self { module: module.clone(), seen: SeenEntries::default() }
    }

    /// The entry that the next record is, if it is one.
    pub(super) fn read(&mut self, text: &str) -> Option<HistoryEntry> {
        let entry = match JournalRecord::from_text(text)? {
            JournalRecord::Transition(transition) if transition.module == self.module => {
                HistoryEntry::Transition(transition)
            }
            JournalRecord::Identification(found) if found.module == self.module => {
                HistoryEntry::Identification(found)
            }
            JournalRecord::Phase(change) if change.module == self.module => {
                HistoryEntry::Phase(change)
            }
            _ => return None,
        };
        self.seen.is_new(&entry).then_some(entry)
    }
}

/// What was there already: a new file begins with the present state once more.
#[derive(Debug, Default)]
struct SeenEntries {
    sequence: u64,
    /// Of each component, the fault last identified and as of when.
    identified: BTreeMap<Component, (u64, Step)>,
    phase: u64,
}

impl SeenEntries {
    fn is_new(&mut self, entry: &HistoryEntry) -> bool {
        match entry {
            HistoryEntry::Transition(transition) => {
                let new = transition.sequence > self.sequence;
                self.sequence = self.sequence.max(transition.sequence);
                new
            }
            HistoryEntry::Identification(found) => {
                let at = (found.sequence, found.as_of_step);
                let known = self.identified.entry(found.component.component.clone());
                let known = known.or_default();
                let new = at > *known;
                *known = at.max(*known);
                new
            }
            HistoryEntry::Phase(change) => {
                let new = change.number > self.phase;
                self.phase = self.phase.max(change.number);
                new
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    use super::super::testing as straightforward;

    fn speaker() -> Speaker {
        Speaker::of("t".parse().unwrap(), "m1".parse().unwrap())
    }

    /// Entries by their number in the order of a journal, and how many were read.
    struct Listed {
        entries: Vec<HistoryEntry>,
        read: usize,
    }

    impl Listed {
        fn new(entries: impl Iterator<Item = HistoryEntry>) -> (Self, HistoryIndex<usize>) {
            let (entries, mut index): (Vec<HistoryEntry>, _) =
                (entries.collect(), HistoryIndex::new());
            for (place, entry) in entries.iter().enumerate() {
                index.enter(entry, place);
            }
            (Self { entries, read: 0 }, index)
        }
    }

    impl EntryReader<usize> for Listed {
        type Error = Infallible;

        fn transition(&mut self, _: u64, place: usize) -> Result<FaultTransition, Infallible> {
            self.read += 1;
            let HistoryEntry::Transition(transition) = &self.entries[place] else { unreachable!() };
            Ok((**transition).clone())
        }

        fn identification(&mut self, _: u64, place: usize) -> Result<Identification, Infallible> {
            self.read += 1;
            let HistoryEntry::Identification(found) = &self.entries[place] else { unreachable!() };
            Ok((**found).clone())
        }

        fn phase(&mut self, _: u64, place: usize) -> Result<PhaseChange, Infallible> {
            self.read += 1;
            let HistoryEntry::Phase(change) = &self.entries[place] else { unreachable!() };
            Ok((**change).clone())
        }
    }

    fn compile(
        speaker: &Speaker,
        all: impl Iterator<Item = HistoryEntry>,
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

    fn transition(sequence: u64) -> HistoryEntry {
        let component = "sensor/g1".parse().unwrap();
        let untouched = speaker().untouched(&component, 0);
        HistoryEntry::Transition(Box::new(FaultTransition { sequence, ..untouched }))
    }

    fn transitions(count: u64) -> impl Iterator<Item = HistoryEntry> {
        (1..=count).map(transition)
    }

    fn found(sequence: u64, as_of: u64) -> HistoryEntry {
        let kind = vocabulary::fault::FaultKind::Bias.into();
        let size =
            vocabulary::FaultSize { value: 1.0 / 3.0, low: 0.1, high: 2.0 / 3.0, own_unit: false };
        let candidate = vocabulary::Candidate { kind, probability: 0.1, size: Some(size) };
        let found = diagnosis::identification::IdentificationResult {
            run: vocabulary::RunId(1),
            sequence,
            component: "sensor/g1".parse().unwrap(),
            as_of: vocabulary::Step(as_of),
            candidates: vec![candidate; 5],
            signature: Vec::new(),
        };
        HistoryEntry::Identification(Box::new(speaker().identification(found, 0)))
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

    fn phase(number: u64) -> HistoryEntry {
        let json = serde_json::json!({
            "structure": "t", "module": "m1", "number": number, "phase": "in_service",
            "before": null, "not_monitored": {}, "run": null, "step": null, "reason": "",
            "time_unix_ns": 5,
        });
        HistoryEntry::Phase(Box::new(serde_json::from_value(json).unwrap()))
    }

    #[test]
    fn each_change_of_phase_is_on_one_page_and_stands_between_its_transitions() {
        let mut all = vec![phase(1), phase(2)];
        for sequence in 1..=9 {
            all.push(transition(sequence));
            if sequence % 3 == 0 {
                all.extend([phase(sequence), phase(sequence + 1)]);
            }
        }
        let (mut listed, index) = Listed::new(all.clone().into_iter());
        for limit in [1, 2, 4, 500] {
            let (mut since, mut numbers) = (1, Vec::new());
            loop {
                let question = HistoryQuestion { since, limit };
                let Ok(page) = super::compile(&speaker(), &index, question, &mut listed);
                assert_eq!(page, compile(&speaker(), all.clone().into_iter(), question));
                numbers.extend(page.phases.iter().map(|change| change.number));
                let Some(last) = page.transitions.last().filter(|_| page.more) else { break };
                since = last.sequence + 1;
            }
            assert_eq!(numbers, [1, 2, 3, 4, 6, 7, 9, 10], "{limit} on a page");
        }
        let many = transitions(1).chain((1..=100).map(phase));
        let (mut listed, index) = Listed::new(many);
        let question = HistoryQuestion::since(1);
        let Ok(page) = super::compile(&speaker(), &index, question, &mut listed);
        let numbers: Vec<u64> = page.phases.iter().map(|change| change.number).collect();
        assert_eq!(numbers, (37..=100).collect::<Vec<_>>(), "the latest");
    }

    #[test]
    fn an_empty_journal_has_an_empty_page() {
        let page = compile(&speaker(), transitions(0), HistoryQuestion::since(1));
        assert_eq!((page.first_sequence, page.next_sequence, page.more), (None, 1, false));
    }

    fn recorded(entry: HistoryEntry) -> String {
        let record = match entry {
            HistoryEntry::Transition(transition) => JournalRecord::Transition(transition),
            HistoryEntry::Identification(found) => JournalRecord::Identification(found),
            HistoryEntry::Phase(change) => JournalRecord::Phase(change),
        };
        record.to_text().unwrap()
    }

    #[test]
    fn entries_are_returned_once_though_a_snapshot_repeats_them() {
        let transition = |sequence| recorded(transition(sequence));
        let found = |as_of| recorded(found(2, as_of));
        let other = recorded(self::found(1, 5)).replace("g1", "g2");
        let phase = |number| recorded(self::phase(number));
        let texts = [
            phase(1),
            transition(1),
            transition(2),
            found(10),
            other,
            found(20),
            transition(3),
            transition(2),
            transition(3),
            found(20),
            transition(4),
            found(30),
            phase(2),
            phase(2),
        ];
        let mut entries = HistoryEntries::of(&"m1".parse().unwrap());
        let entries = texts.iter().filter_map(|text| entries.read(text)).map(|entry| match entry {
            HistoryEntry::Transition(transition) => format!("{}", transition.sequence),
            HistoryEntry::Identification(found) => {
                format!("{}@{}", found.sequence, found.as_of_step)
            }
            HistoryEntry::Phase(change) => format!("phase {}", change.number),
        });
        let entries: Vec<String> = entries.collect();
        assert_eq!(
            entries,
            ["phase 1", "1", "2", "2@10", "1@5", "2@20", "3", "4", "2@30", "phase 2"]
        );
    }
}
