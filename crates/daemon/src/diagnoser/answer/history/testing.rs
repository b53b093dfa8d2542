//! Pages as they come from reading the whole journal for each of them: what every other way has to come to.

use std::collections::{BTreeMap, VecDeque};

use vocabulary::{
    HistoryPage, HistoryQuestion, Identification, MAX_IDENTIFICATIONS_OF_FAULT,
    MAX_PHASE_CHANGES_ON_PAGE, PhaseChange,
};

use super::page::{HistoryEntry, PAGE_BYTES, length};
use diagnosis::messages::Speaker;

/// The page of `all` entries that is asked for. `all` is read to its end: the numbers on the page say how far the
/// journal reaches, and a fault may be identified anew long after it was declared.
pub(super) fn compile(
    speaker: &Speaker,
    all: impl Iterator<Item = HistoryEntry>,
    question: HistoryQuestion,
) -> HistoryPage {
    let mut page = HistoryPage {
        structure: speaker.structure.clone(),
        module: speaker.module.clone(),
        transitions: Vec::new(),
        identifications: Vec::new(),
        phases: Vec::new(),
        first_sequence: None,
        next_sequence: 1,
        more: false,
    };
    let mut bytes = 0;
    let mut identified = Identified::default();
    let mut phases: Vec<(u64, PhaseChange)> = Vec::new();
    for entry in all {
        let transition = match entry {
            HistoryEntry::Transition(transition) => *transition,
            HistoryEntry::Identification(found) => {
                identified.enter(*found, question.since);
                continue;
            }
            HistoryEntry::Phase(change) => {
                phases.push((page.next_sequence - 1, *change));
                continue;
            }
        };
        page.first_sequence.get_or_insert(transition.sequence);
        page.next_sequence = transition.sequence + 1;
        if transition.sequence < question.since || page.more {
            continue;
        }
        bytes += length(&transition);
        page.more = page.transitions.len() as u64 == question.limit || bytes > PAGE_BYTES;
        if !page.more {
            page.transitions.push(transition);
        }
    }
    identified.complete(&mut page);
    let last = page.transitions.last().filter(|_| page.more).map(|last| last.sequence);
    phases
        .retain(|(after, _)| after + 1 >= question.since && last.is_none_or(|last| *after < last));
    let skipped = phases.len().saturating_sub(MAX_PHASE_CHANGES_ON_PAGE);
    page.phases = phases.into_iter().skip(skipped).map(|(_, change)| change).collect();
    page
}

/// The latest identifications of each fault, by the number of the transition that declared it.
#[derive(Debug, Default)]
struct Identified(BTreeMap<u64, VecDeque<Identification>>);

impl Identified {
    fn enter(&mut self, found: Identification, since: u64) {
        if found.sequence < since {
            return;
        }
        let of_fault = self.0.entry(found.sequence).or_default();
        if of_fault.len() == MAX_IDENTIFICATIONS_OF_FAULT {
            of_fault.pop_front();
        }
        of_fault.push_back(found);
    }

    /// Adds to each transition of the page what belongs to it, and ends the page where it would get too long. It
    /// keeps its first transition, or the next page would be the same.
    fn complete(mut self, page: &mut HistoryPage) {
        let mut bytes = 0;
        for place in 0..page.transitions.len() {
            let transition = &page.transitions[place];
            let later = self.0.split_off(&(transition.sequence + 1));
            let found = std::mem::replace(&mut self.0, later);
            let found: Vec<Identification> = found.into_values().flatten().collect();
            bytes += length(transition) + found.iter().map(length).sum::<usize>();
            if bytes > PAGE_BYTES && place > 0 {
                page.transitions.truncate(place);
                page.more = true;
                return;
            }
            let mut room = PAGE_BYTES;
            page.identifications.extend(found.into_iter().take_while(|found| {
                room = room.saturating_sub(length(found));
                room > 0
            }));
        }
    }
}
