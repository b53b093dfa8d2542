//! The changes whose judgement is open.

use vocabulary::Step;

use super::case::Case;

/// Most changes of one channel that await their judgement. Reached only while peers stay silent for long; then
/// the smallest of the later ones is given up, and counted.
const MAX_PENDING: usize = 8;

/// The changes that await their judgement.
#[derive(Debug, Clone, Default)]
pub(super) struct OpenCases {
    cases: Vec<Case>,
    given_up: u64,
}

impl OpenCases {
    /// Forgets them; the count stays.
    pub(super) fn clear(&mut self) {
        self.cases.clear();
    }

    /// Opens one; if its channel has too many, the smallest of the later ones is given up. The first one stays: it
    /// tells when the fault began.
    pub(super) fn open(&mut self, case: Case) {
        let channel = case.channel;
        self.cases.push(case);
        let of_channel = || self.iter().enumerate().filter(|(_, case)| case.channel == channel);
        if of_channel().count() <= MAX_PENDING {
            return;
        }
        let first = of_channel().min_by_key(|(_, case)| case.change).map(|(place, _)| place);
        let later = of_channel().filter(|(place, _)| Some(*place) != first);
        let ratio = |case: &Case| case.evidence.ratio();
        let smallest = later.min_by(|(_, a), (_, b)| ratio(a).total_cmp(&ratio(b)));
        if let Some((place, _)) = smallest {
            self.cases.remove(place);
            self.given_up += 1;
        }
    }

    /// How many were given up without a judgement.
    pub(super) fn given_up(&self) -> u64 {
        self.given_up
    }

    /// Drops those of a channel.
    pub(super) fn close_all_of(&mut self, channel: usize) {
        self.cases.retain(|case| case.channel != channel);
    }

    /// Takes out those that are due, in the order in which they are judged.
    pub(super) fn take_due(&mut self, now: Step) -> Vec<Case> {
        self.cases.sort_by_key(|case| (case.decide_at, case.channel));
        let due = self.cases.partition_point(|case| case.decide_at <= now);
        self.cases.drain(..due).collect()
    }

    /// One that was due, or is taken up after a restart, stays open.
    pub(super) fn keep(&mut self, case: Case) {
        self.cases.push(case);
    }

    /// Those that were not returned here before.
    pub(super) fn take_new(&mut self) -> Vec<Case> {
        let new = self.cases.iter_mut().filter(|case| case.new);
        new.map(|case| {
            case.new = false;
            case.clone()
        })
        .collect()
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Case> {
        self.cases.iter()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.cases.is_empty()
    }
}
