//! The transitions of one module: each once, in their order, and what is asked to fill gaps. A plain value: messages,
//! answers and the time go in, events and questions come out.

use std::collections::BTreeMap;
use std::ops::Range;
use std::time::{Duration, Instant};

use wire::{FaultTransition, HistoryPage, ModuleStatus};

use super::place::{Mark, Place, place};
use super::retries::Retries;

/// Transitions of a module that are held back until those before them are there.
const HELD: usize = 256;
/// A status that knows of more, or of fewer, transitions than were handed out is believed if it is not superseded within
/// this time: a transition that was just published may come after it.
const SETTLING: Duration = Duration::from_secs(1);
/// A module that sends no status is asked for its present state at this interval.
pub(super) const LOOK_EVERY: Duration = Duration::from_secs(10);

/// What becomes of a transition.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Outcome {
    /// It is handed out.
    Handed(Box<FaultTransition>),
    /// Those of these numbers cannot be had.
    Missed {
        /// The numbers.
        numbers: Range<u64>,
        /// Why not.
        reason: String,
    },
}

/// What is to be asked of a module.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Wish {
    /// Its present state.
    Present,
    /// Its journal from this sequence number on.
    History(u64),
}

/// Where a module stands.
#[derive(Debug, Default)]
pub(super) struct Line {
    /// The number due next; `None` until the first answer or, failing that, the first transition.
    next: Option<u64>,
    /// The latest that was handed out.
    latest: Mark,
    /// After a new beginning, the time of the latest transition before it: what the journal has from then was handed out.
    old_until_unix_ns: u64,
    /// Transitions as they were published, whose predecessors are missing.
    held: BTreeMap<u64, FaultTransition>,
    /// Transitions as they are at present, for the case that the journal does not give them.
    present: BTreeMap<u64, FaultTransition>,
    /// The number after the last that the module is known to have given.
    end: u64,
    /// Since when it is known of more than were handed out.
    behind_since: Option<Instant>,
    /// Since when it is known of fewer.
    fallen_since: Option<Instant>,
    /// The number after the last that was reported as missed.
    reported: u64,
    /// Its present state is to be asked for.
    look: bool,
    retries: Retries,
    /// When it last sent a status or its present state.
    heard: Option<Instant>,
    /// Several processes run as the module, each with numbers of its own.
    shared: bool,
}

impl Line {
    /// The module has appeared, perhaps again.
    pub(super) fn appear(&mut self) {
        self.look = true;
        self.retries.forgive();
    }

    /// The module has gone: it is not asked until it is heard of again.
    pub(super) fn disappear(&mut self) {
        self.heard = None;
    }

    /// A transition that was published.
    pub(super) fn published(&mut self, transition: FaultTransition) -> Vec<Outcome> {
        if self.shared {
            return self.pass(transition);
        }
        match self.next {
            None if !self.look => self.begin_with(&transition),
            None => {}
            Some(_) => match place(self.latest, &transition) {
                Place::Before => return Vec::new(),
                Place::After => {}
                Place::NewBeginning => self.begin_again(transition.incarnation),
            },
        }
        self.held.insert(transition.sequence, transition);
        if self.held.len() > HELD {
            return self.give_up("too many have come since");
        }
        self.release()
    }

    /// Of several processes each transition is handed out as it comes.
    fn pass(&mut self, transition: FaultTransition) -> Vec<Outcome> {
        if Mark::of(&transition) == self.latest {
            return Vec::new();
        }
        self.latest = Mark::of(&transition);
        self.next = Some(self.latest.sequence.saturating_add(1));
        vec![Outcome::Handed(Box::new(transition))]
    }

    /// What a status says of the numbers.
    pub(super) fn status(&mut self, status: &ModuleStatus, now: Instant) -> Vec<Outcome> {
        self.heard = Some(now);
        if status.another_process {
            return self.share();
        }
        if std::mem::take(&mut self.shared) {
            self.begin_again(status.journal.incarnation);
        }
        let Some(next) = self.next else { return Vec::new() };
        let is_fallen =
            status.next_sequence < next && status.time_unix_ns > self.latest.time_unix_ns;
        self.fallen_since = is_fallen.then(|| self.fallen_since.unwrap_or(now));
        if self.fallen_since.is_some_and(|since| now - since >= SETTLING) {
            self.begin_again(status.journal.incarnation);
        }
        self.know_of(status.next_sequence, now);
        Vec::new()
    }

    /// Several processes run as the module: nothing is missing, whatever the numbers.
    fn share(&mut self) -> Vec<Outcome> {
        (self.end, self.behind_since, self.fallen_since) = (0, None, None);
        let held = self.give_up("several processes run as the module");
        self.shared = true;
        held
    }

    /// The module has given all numbers below `end`.
    fn know_of(&mut self, end: u64, now: Instant) {
        self.end = end;
        let is_behind = self.next.is_some_and(|next| end > next);
        self.behind_since = is_behind.then(|| self.behind_since.unwrap_or(now));
    }

    /// The module's present state, the latest transition of each component; empty if it did not answer.
    pub(super) fn present(&mut self, states: Vec<FaultTransition>, now: Instant) -> Vec<Outcome> {
        if states.is_empty() {
            return self.no_present(now);
        }
        (self.look, self.heard) = (false, Some(now));
        self.retries.succeed();
        let numbered = |state: &FaultTransition| state.sequence > 0;
        self.present = states.into_iter().filter(numbered).map(|t| (t.sequence, t)).collect();
        if self.next.is_none() {
            return self.begin();
        }
        let latest = self.latest;
        let mut states = self.present.values();
        let new = states.find(|state| place(latest, state) == Place::NewBeginning);
        if let Some(incarnation) = new.map(|state| state.incarnation) {
            self.begin_again(incarnation);
        }
        let next = self.next.unwrap_or(1);
        self.present.retain(|sequence, _| *sequence >= next);
        if let Some(last) = self.present.keys().next_back() {
            self.end = self.end.max(last.saturating_add(1));
            self.behind_since = Some(now.checked_sub(SETTLING).unwrap_or(now));
        }
        Vec::new()
    }

    fn no_present(&mut self, now: Instant) -> Vec<Outcome> {
        if !self.retries.fail(now) {
            return Vec::new();
        }
        (self.look, self.heard) = (false, Some(now));
        if let (None, Some(first)) = (self.next, self.held.values().next().cloned()) {
            self.begin_with(&first);
        }
        self.release()
    }

    /// The first that is known of the module: the latest of every component, and what was published meanwhile.
    fn begin(&mut self) -> Vec<Outcome> {
        let mut outcomes = Vec::new();
        for state in std::mem::take(&mut self.present).into_values() {
            self.latest = Mark::of(&state);
            outcomes.push(Outcome::Handed(Box::new(state)));
        }
        self.next = Some(self.latest.sequence.saturating_add(1));
        for transition in std::mem::take(&mut self.held).into_values() {
            outcomes.extend(self.published(transition));
        }
        outcomes
    }

    fn begin_with(&mut self, first: &FaultTransition) {
        self.next = Some(first.sequence);
        self.latest.incarnation = first.incarnation;
        self.latest.sequence = first.sequence.saturating_sub(1);
    }

    /// What the module counts from the beginning is not what it counted before.
    fn begin_again(&mut self, incarnation: u64) {
        let old_until_unix_ns = self.latest.time_unix_ns;
        self.held.retain(|_, transition| transition.time_unix_ns > old_until_unix_ns);
        self.old_until_unix_ns = old_until_unix_ns;
        (self.latest.incarnation, self.latest.sequence) = (incarnation, 0);
        (self.next, self.end, self.reported) = (Some(1), 0, 0);
        (self.behind_since, self.fallen_since) = (None, None);
        self.retries.forgive();
    }

    /// A page of the journal from `since` on, or why there is none.
    pub(super) fn page(
        &mut self,
        since: u64,
        page: Result<HistoryPage, String>,
        now: Instant,
    ) -> Vec<Outcome> {
        let page = match page {
            Ok(page) if self.next == Some(since) => page,
            // It began again meanwhile, or what was missing has come.
            Ok(_) => {
                self.retries.succeed();
                return Vec::new();
            }
            Err(reason) => return self.in_vain(&reason, now),
        };
        let numbers = page.transitions.iter().map(|transition| transition.sequence);
        let covered = numbers.max().map_or(since, |last| last.saturating_add(1));
        for transition in page.transitions {
            self.held.insert(transition.sequence, transition);
        }
        let outcomes = self.release_below(covered, "the module's journal does not have them");
        if self.next == Some(since) {
            return self.in_vain("the module's journal does not have them yet", now);
        }
        self.retries.succeed();
        let ago = now.checked_sub(SETTLING).unwrap_or(now);
        if page.more {
            self.end = self.end.max(page.next_sequence);
            self.behind_since = Some(ago);
        }
        outcomes
    }

    fn in_vain(&mut self, reason: &str, now: Instant) -> Vec<Outcome> {
        if self.retries.fail(now) { self.give_up(reason) } else { Vec::new() }
    }

    /// Hands out what there is without what is missing.
    fn give_up(&mut self, reason: &str) -> Vec<Outcome> {
        for (sequence, state) in std::mem::take(&mut self.present) {
            self.held.entry(sequence).or_insert(state);
        }
        let Some(next) = self.next else {
            let first = self.held.values().next().cloned();
            first.iter().for_each(|first| self.begin_with(first));
            return self.release();
        };
        if let Some(last) = self.held.keys().next_back() {
            self.retries.forgive();
            return self.release_below(last.saturating_add(1), reason);
        }
        // They may come yet: nothing after them has.
        let missed = self.missed(next..self.end, reason);
        self.reported = self.reported.max(self.end);
        missed.into_iter().collect()
    }

    /// Hands out what is held and due.
    fn release(&mut self) -> Vec<Outcome> {
        self.release_below(0, "")
    }

    /// Hands out what is held and due; of the numbers below `end`, those that are not held are missed.
    fn release_below(&mut self, end: u64, reason: &str) -> Vec<Outcome> {
        let Some(mut next) = self.next else { return Vec::new() };
        let mut outcomes = Vec::new();
        while let Some((&sequence, _)) = self.held.first_key_value() {
            if sequence > next && next < end {
                outcomes.extend(self.missed(next..sequence, reason));
                next = sequence;
            }
            if sequence > next {
                break;
            }
            let Some(transition) = self.held.remove(&sequence) else { break };
            if sequence == next {
                outcomes.extend(self.hand_out(transition));
                next = next.saturating_add(1);
            }
        }
        if next < end && self.held.is_empty() {
            outcomes.extend(self.missed(next..end, reason));
            next = end;
        }
        self.next = Some(next);
        self.latest.sequence = next.saturating_sub(1);
        self.present.retain(|sequence, _| *sequence >= next);
        if self.end <= next {
            self.behind_since = None;
        }
        outcomes
    }

    fn hand_out(&mut self, transition: FaultTransition) -> Option<Outcome> {
        if transition.time_unix_ns <= self.old_until_unix_ns {
            return None;
        }
        self.old_until_unix_ns = 0;
        self.latest = Mark::of(&transition);
        Some(Outcome::Handed(Box::new(transition)))
    }

    /// Those of these numbers that were not reported before. Before the first transition of a new beginning it is not known
    /// whether any is missing.
    fn missed(&self, numbers: Range<u64>, reason: &str) -> Option<Outcome> {
        let numbers = numbers.start.max(self.reported)..numbers.end;
        let is_known = self.old_until_unix_ns == 0
            || self.held.values().next().is_none_or(|t| t.time_unix_ns > self.old_until_unix_ns);
        (is_known && !numbers.is_empty())
            .then(|| Outcome::Missed { numbers, reason: reason.to_owned() })
    }

    /// The question that is due now, if one is.
    pub(super) fn question(&mut self, now: Instant) -> Option<Wish> {
        let wish = self.wish(now).filter(|_| self.retries.may_ask(now))?;
        self.retries.ask();
        Some(wish)
    }

    fn wish(&self, now: Instant) -> Option<Wish> {
        let is_due = self.heard.is_some_and(|heard| now - heard >= LOOK_EVERY);
        if self.look || (is_due && !self.shared) {
            return Some(Wish::Present);
        }
        let next = self.next.filter(|_| !self.shared)?;
        let is_behind = self.behind_since.is_some_and(|since| now - since >= SETTLING);
        (!self.held.is_empty() || is_behind).then_some(Wish::History(next))
    }
}
