//! Which entry of the journal is where. 24 bytes for each transition, which takes some hundred in the journal.

use std::collections::{BTreeMap, VecDeque};

use vocabulary::MAX_IDENTIFICATIONS_OF_FAULT;

use crate::diagnoser::state::Entry;

/// The places of the entries that pages can show.
#[derive(Debug)]
pub(super) struct Index<P> {
    /// With their numbers, which ascend.
    transitions: Vec<(u64, P)>,
    /// The latest of each fault, by the number of the transition that declared it, in the order of their entry.
    identifications: BTreeMap<u64, VecDeque<P>>,
}

impl<P: Copy> Index<P> {
    pub(super) fn new() -> Self {
        Self { transitions: Vec::new(), identifications: BTreeMap::new() }
    }

    /// Takes in the entries of a module in their order, each once.
    pub(super) fn enter(&mut self, entry: &Entry, place: P) {
        match entry {
            Entry::Transition(transition) => self.transitions.push((transition.sequence, place)),
            Entry::Identification(found) => {
                let of_fault = self.identifications.entry(found.sequence).or_default();
                if of_fault.len() == MAX_IDENTIFICATIONS_OF_FAULT {
                    of_fault.pop_front();
                }
                of_fault.push_back(place);
            }
        }
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
