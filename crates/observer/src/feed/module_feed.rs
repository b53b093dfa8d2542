//! The feed of one module: hands out its transitions once each and in order, its identifications and phases once each,
//! and decides which questions fill gaps.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::time::{Duration, Instant};

use vocabulary::{
    ComponentPath, FaultTransition, HistoryPage, Identification, ModuleName, ModuleStatus,
    PhaseChange, StructureName,
    delivery::{Due, GapFiller},
};

use super::ModuleKey;
use super::retries::Retries;
use crate::view::News;

/// Transitions of a module that are held back while earlier ones are missing.
const HELD: usize = 256;
/// A status that counts more or fewer transitions than were handed out is believed unless a transition contradicts it
/// within this time: one that was just published may arrive after the status.
const SETTLING: Duration = Duration::from_secs(1);
/// Interval at which a module that sends no status is asked for its present state.
pub(super) const LOOK_EVERY: Duration = Duration::from_secs(10);

/// A module shared by several processes is reported again only after this long without such a report.
const SEVERAL_OVER: Duration = Duration::from_secs(60);
/// Transitions whose times are remembered.
const REMEMBERED: usize = 2048;
/// Components whose latest identification is remembered.
const COMPONENTS: usize = 1024;

/// A question to a module.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModuleQuery {
    /// Its present state.
    Present,
    /// Its journal from this sequence number on.
    History(u64),
}

/// Identifies the latest transition that was handed out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct LatestTransition {
    /// The incarnation that its sequence number belongs to.
    incarnation: u64,
    sequence: u64,
    time_unix_ns: u64,
}

impl LatestTransition {
    fn of(transition: &FaultTransition) -> Self {
        let (incarnation, sequence) = transition.place();
        Self { incarnation, sequence, time_unix_ns: transition.time_unix_ns }
    }

    /// Whether the transition comes after this one in the module's numbering.
    fn precedes(&self, transition: &FaultTransition) -> bool {
        transition.place() > (self.incarnation, self.sequence)
    }
}

/// What is known of one module's sequence.
#[derive(Debug)]
pub(super) struct ModuleFeed {
    structure: StructureName,
    module: ModuleName,
    /// Published transitions in the order of their sequence numbers.
    filler: GapFiller<FaultTransition>,
    /// Whether the next sequence number is known: after the first answer or, without an answer, the first transition.
    is_begun: bool,
    latest: LatestTransition,
    /// When each of the latest transitions that were handed out was published, by its number \[ns since 1970\].
    times: BTreeMap<u64, u64>,
    /// After a restarted numbering, the time of the last transition before it: older journal entries were handed out
    /// already.
    old_until_unix_ns: u64,
    /// The present transitions, handed out if the journal cannot supply them.
    present: BTreeMap<u64, FaultTransition>,
    /// One more than the highest sequence number that the module is known to have used.
    end: u64,
    /// Since when the module has been known to have published more transitions than were handed out.
    behind_since: Option<Instant>,
    /// Since when its status has counted fewer.
    fallen_since: Option<Instant>,
    /// One more than the highest sequence number reported as missed.
    reported: u64,
    /// Whether to ask for its present state.
    look: bool,
    retries: Retries,
    /// When its latest status or present state arrived.
    heard: Option<Instant>,
    /// Several processes run as this module, each with its own numbering.
    shared: bool,
    /// When a status last reported several processes.
    several_at: Option<Instant>,
    /// The latest identification handed out of each component.
    identifications: BTreeMap<ComponentPath, Identification>,
    /// The latest phase handed out.
    phase: Option<PhaseChange>,
}

impl ModuleFeed {
    /// The feed of a module that has just appeared.
    pub(super) fn new((structure, module): &ModuleKey) -> Self {
        Self {
            structure: structure.clone(),
            module: module.clone(),
            filler: GapFiller::default(),
            is_begun: false,
            latest: LatestTransition::default(),
            times: BTreeMap::new(),
            old_until_unix_ns: 0,
            present: BTreeMap::new(),
            end: 0,
            behind_since: None,
            fallen_since: None,
            reported: 0,
            look: true,
            retries: Retries::default(),
            heard: None,
            shared: false,
            several_at: None,
            identifications: BTreeMap::new(),
            phase: None,
        }
    }

    /// Whether nothing is known of it but its liveliness token.
    pub(super) fn is_only_seen(&self) -> bool {
        self.latest == LatestTransition::default()
            && (self.end, self.filler.held().len()) == (0, 0)
            && self.identifications.is_empty()
            && self.phase.is_none()
    }

    /// The next sequence number, if known.
    fn next(&self) -> Option<u64> {
        self.is_begun.then(|| self.filler.next())
    }

    /// Handles the module's appearance or reappearance.
    pub(super) fn appear(&mut self) {
        self.look = true;
        self.retries.forgive();
    }

    /// Handles the module's disappearance: it is not queried until it publishes again, and what is missing of it is not
    /// given up while it may be restarting.
    pub(super) fn disappear(&mut self, now: Instant) {
        self.heard = None;
        self.retries.await_return(now);
    }

    /// Whether the module counts again, because its state directory was wiped, it has none, or no disk had its latest
    /// transitions: the transition has a later incarnation, or the number of another one. That its time is later says so of
    /// numbers that are not remembered only, because clocks are set back.
    fn is_counted_again(&self, transition: &FaultTransition) -> bool {
        let LatestTransition { incarnation, sequence, time_unix_ns } = self.latest;
        if transition.incarnation != incarnation || transition.sequence > sequence {
            return transition.incarnation > incarnation;
        }
        match self.times.get(&transition.sequence) {
            Some(known) => transition.time_unix_ns != *known,
            None => transition.time_unix_ns > time_unix_ns,
        }
    }

    /// Remembers the latest transition that was handed out.
    fn note(&mut self, transition: &FaultTransition) {
        self.latest = LatestTransition::of(transition);
        self.times.insert(transition.sequence, transition.time_unix_ns);
        while self.times.len() > REMEMBERED {
            self.times.pop_first();
        }
    }

    /// Handles a published transition.
    pub(super) fn published(&mut self, transition: FaultTransition) -> Vec<News> {
        if self.shared {
            return self.pass(transition);
        }
        if self.is_begun {
            if self.is_counted_again(&transition) {
                self.begin_again(transition.incarnation);
            } else if !self.latest.precedes(&transition) {
                return Vec::new();
            }
        } else if !self.look {
            self.begin_with(transition.incarnation, transition.sequence);
        }
        self.hold(transition);
        if self.filler.held().len() > HELD {
            return self.give_up("too many newer transitions");
        }
        self.release()
    }

    /// Holds a transition; a duplicate of a held one is dropped.
    fn hold(&mut self, transition: FaultTransition) {
        let _ = self.filler.take(transition.sequence, transition);
    }

    /// Hands out a transition at once, because transitions of several processes have no common order.
    fn pass(&mut self, transition: FaultTransition) -> Vec<News> {
        if LatestTransition::of(&transition) == self.latest {
            return Vec::new();
        }
        self.note(&transition);
        (self.filler, self.is_begun) = (after(self.latest), true);
        vec![News::Fault(Box::new(transition))]
    }

    /// Compares the numbers in a status with what was handed out.
    pub(super) fn status(&mut self, status: &ModuleStatus, now: Instant) -> Vec<News> {
        self.heard = Some(now);
        if status.another_process {
            return self.share(now);
        }
        if std::mem::take(&mut self.shared) {
            self.begin_again(status.journal.incarnation);
        }
        let Some(next) = self.next() else { return Vec::new() };
        let is_fallen =
            status.next_sequence < next && status.time_unix_ns > self.latest.time_unix_ns;
        self.fallen_since = is_fallen.then(|| self.fallen_since.unwrap_or(now));
        if self.fallen_since.is_some_and(|since| now - since >= SETTLING) {
            self.begin_again(status.journal.incarnation);
        }
        self.know_of(status.next_sequence, now);
        Vec::new()
    }

    /// Several processes run as the module, so gaps in the numbers do not mean missed transitions.
    fn share(&mut self, now: Instant) -> Vec<News> {
        (self.end, self.behind_since, self.fallen_since) = (0, None, None);
        let mut news = self.give_up("several processes run as the module");
        self.shared = true;
        let before = self.several_at.replace(now);
        if before.is_none_or(|before| now.duration_since(before) >= SEVERAL_OVER) {
            let (structure, module) = (self.structure.clone(), self.module.clone());
            news.push(News::SeveralProcesses { structure, module });
        }
        news
    }

    /// Handles an identification. A published one is news unless it equals the latest; an answer may be older than the
    /// latest published one, or differ from it only insignificantly.
    pub(super) fn identification(
        &mut self,
        found: Identification,
        is_answer: bool,
    ) -> Option<News> {
        let is_news = self.identifications.get(&found.component).is_none_or(|before| {
            if is_answer {
                found.time_unix_ns > before.time_unix_ns && essence(before) != essence(&found)
            } else {
                *before != found
            }
        });
        if !is_news {
            return None;
        }
        if self.identifications.len() >= COMPONENTS {
            self.identifications.clear();
        }
        self.identifications.insert(found.component.clone(), found.clone());
        Some(News::Identification(Box::new(found)))
    }

    /// Handles a change of phase by the same rules as an identification.
    pub(super) fn phase(&mut self, change: PhaseChange, is_answer: bool) -> Option<News> {
        let is_news = self.phase.as_ref().is_none_or(|before| {
            if is_answer { change.time_unix_ns > before.time_unix_ns } else { *before != change }
        });
        is_news.then(|| {
            self.phase = Some(change.clone());
            News::Phase(change)
        })
    }

    /// Records that the module has used all numbers below `end`.
    fn know_of(&mut self, end: u64, now: Instant) {
        self.end = end;
        let is_behind = self.next().is_some_and(|next| end > next);
        self.behind_since = is_behind.then(|| self.behind_since.unwrap_or(now));
    }

    /// Handles the module's present state, the latest transition of each component; an empty list if it did not answer.
    pub(super) fn present(&mut self, states: Vec<FaultTransition>, now: Instant) -> Vec<News> {
        if states.is_empty() {
            return self.no_present(now);
        }
        (self.look, self.heard) = (false, Some(now));
        self.retries.succeed();
        let numbered = |state: &FaultTransition| state.sequence > 0;
        self.present = states.into_iter().filter(numbered).map(|t| (t.sequence, t)).collect();
        if !self.is_begun {
            return self.begin();
        }
        let new = self.present.values().find(|state| self.is_counted_again(state));
        if let Some(incarnation) = new.map(|state| state.incarnation) {
            self.begin_again(incarnation);
        }
        let next = self.filler.next();
        self.present.retain(|sequence, _| *sequence >= next);
        if let Some(last) = self.present.keys().next_back() {
            self.end = self.end.max(last.saturating_add(1));
            self.behind_since = Some(now.checked_sub(SETTLING).unwrap_or(now));
        }
        Vec::new()
    }

    fn no_present(&mut self, now: Instant) -> Vec<News> {
        if !self.retries.fail(now) {
            return Vec::new();
        }
        (self.look, self.heard) = (false, Some(now));
        self.begin_at_first();
        self.release()
    }

    /// Starts the sequence with the latest transition of every component and those published since. Of the former
    /// those are events that were published meanwhile.
    fn begin(&mut self) -> Vec<News> {
        let mut news = Vec::new();
        let published: BTreeSet<_> = self.filler.held().map(FaultTransition::place).collect();
        for state in std::mem::take(&mut self.present).into_values() {
            self.note(&state);
            let is_event = published.contains(&state.place());
            let state = Box::new(state);
            news.push(if is_event { News::Fault(state) } else { News::Present(state) });
        }
        self.is_begun = true;
        let held = std::mem::replace(&mut self.filler, after(self.latest));
        for (_, transition) in held.into_held() {
            news.extend(self.published(transition));
        }
        news
    }

    /// Starts with the first held transition if the next number is not known.
    fn begin_at_first(&mut self) {
        let first = self.filler.held().next().map(FaultTransition::place);
        if let (false, Some((incarnation, sequence))) = (self.is_begun, first) {
            self.begin_with(incarnation, sequence);
        }
    }

    fn begin_with(&mut self, incarnation: u64, sequence: u64) {
        self.is_begun = true;
        (self.latest.incarnation, self.latest.sequence) = (incarnation, sequence.saturating_sub(1));
        self.restart(sequence, |_| true);
    }

    /// Restarts at another number, keeping held transitions from there on that `is_wanted` accepts.
    fn restart(&mut self, next: u64, is_wanted: impl Fn(&FaultTransition) -> bool) {
        let held = std::mem::replace(&mut self.filler, GapFiller::starting_at(next));
        let wanted = held.into_held().map(|(_, transition)| transition);
        wanted.filter(is_wanted).for_each(|transition| self.hold(transition));
    }

    /// Starts over with a new numbering, unrelated to the former one.
    fn begin_again(&mut self, incarnation: u64) {
        let old_until_unix_ns = self.latest.time_unix_ns;
        self.restart(1, |transition| transition.time_unix_ns > old_until_unix_ns);
        self.is_begun = true;
        self.old_until_unix_ns = old_until_unix_ns;
        if incarnation != self.latest.incarnation {
            self.times.clear();
        }
        (self.latest.incarnation, self.latest.sequence) = (incarnation, 0);
        (self.end, self.reported) = (0, 0);
        (self.behind_since, self.fallen_since) = (None, None);
        self.retries.forgive();
    }

    /// Handles a page of the journal from `since` on, or the reason why it could not be read.
    pub(super) fn page(
        &mut self,
        since: u64,
        page: Result<HistoryPage, String>,
        now: Instant,
    ) -> Vec<News> {
        let page = match page {
            Ok(page) if self.next() == Some(since) => page,
            // The numbering restarted meanwhile, or the missing transitions arrived.
            Ok(_) => {
                self.retries.succeed();
                return Vec::new();
            }
            Err(reason) => return self.in_vain(&reason, now),
        };
        let numbers = page.transitions.iter().map(|transition| transition.sequence);
        let covered = numbers.max().map_or(since, |last| last.saturating_add(1));
        page.transitions.into_iter().for_each(|transition| self.hold(transition));
        let news = self.release_below(covered, "the module's journal does not have them");
        if self.next() == Some(since) {
            return self.in_vain("the module's journal does not have them yet", now);
        }
        self.retries.succeed();
        let ago = now.checked_sub(SETTLING).unwrap_or(now);
        if page.more {
            self.end = self.end.max(page.next_sequence);
            self.behind_since = Some(ago);
        }
        news
    }

    fn in_vain(&mut self, reason: &str, now: Instant) -> Vec<News> {
        if self.retries.fail(now) { self.give_up(reason) } else { Vec::new() }
    }

    /// Hands out what is held without waiting for the missing transitions.
    fn give_up(&mut self, reason: &str) -> Vec<News> {
        std::mem::take(&mut self.present).into_values().for_each(|state| self.hold(state));
        let Some(next) = self.next() else {
            self.begin_at_first();
            return self.release();
        };
        if self.filler.held().len() > 0 {
            self.retries.forgive();
            return self.release_below(self.filler.end(), reason);
        }
        // The sequence does not advance: nothing later has arrived, so the missing ones may still arrive.
        let missed = self.missed(next..self.end, reason);
        self.reported = self.reported.max(self.end);
        missed.into_iter().collect()
    }

    /// Hands out held transitions up to the next gap.
    fn release(&mut self) -> Vec<News> {
        self.release_below(0, "")
    }

    /// Hands out held transitions up to the next gap; numbers below `end` that are not held are reported as missed.
    fn release_below(&mut self, end: u64, reason: &str) -> Vec<News> {
        if !self.is_begun {
            return Vec::new();
        }
        self.filler.know_of(end);
        self.filler.give_up(0..end);
        let mut news = Vec::new();
        while let Some(due) = self.filler.due() {
            news.extend(match due {
                Due::Item(_, transition) => self.hand_out(transition),
                Due::Lost(numbers) => self.missed(numbers, reason),
            });
        }
        let next = self.filler.next();
        self.latest.sequence = next.saturating_sub(1);
        self.present.retain(|sequence, _| *sequence >= next);
        if self.end <= next {
            self.behind_since = None;
        }
        news
    }

    fn hand_out(&mut self, transition: FaultTransition) -> Option<News> {
        let is_known = self.times.get(&transition.sequence) == Some(&transition.time_unix_ns);
        if is_known || transition.time_unix_ns <= self.old_until_unix_ns {
            return None;
        }
        self.old_until_unix_ns = 0;
        self.note(&transition);
        Some(News::Fault(Box::new(transition)))
    }

    /// Reports those of these numbers that were not reported before. Before the first transition of a new numbering,
    /// whether any is missing cannot be known.
    fn missed(&self, numbers: Range<u64>, reason: &str) -> Option<News> {
        let numbers = numbers.start.max(self.reported)..numbers.end;
        let is_known = self.old_until_unix_ns == 0
            || self.filler.held().next().is_none_or(|t| t.time_unix_ns > self.old_until_unix_ns);
        (is_known && !numbers.is_empty()).then(|| News::Missed {
            structure: self.structure.clone(),
            module: self.module.clone(),
            from: numbers.start,
            to: numbers.end - 1,
            reason: reason.to_owned(),
        })
    }

    /// The question that is due, if any.
    pub(super) fn question(&mut self, now: Instant) -> Option<ModuleQuery> {
        let wish = self.wish(now).filter(|_| self.retries.may_ask(now))?;
        self.retries.ask();
        Some(wish)
    }

    fn wish(&self, now: Instant) -> Option<ModuleQuery> {
        let is_due = self.heard.is_some_and(|heard| now - heard >= LOOK_EVERY);
        if self.look || (is_due && !self.shared) {
            return Some(ModuleQuery::Present);
        }
        let next = self.next().filter(|_| !self.shared)?;
        let is_behind = self.behind_since.is_some_and(|since| now - since >= SETTLING);
        (self.filler.held().len() > 0 || is_behind).then_some(ModuleQuery::History(next))
    }
}

/// What makes an identification news: its fault and its kind. The size differs slightly in every answer.
fn essence(found: &Identification) -> (u64, bool, Option<&str>) {
    let likeliest = found.candidates.first();
    (found.sequence, found.decided, likeliest.map(|candidate| candidate.kind.as_str()))
}

/// A filler that continues after this transition.
fn after(latest: LatestTransition) -> GapFiller<FaultTransition> {
    GapFiller::starting_at(latest.sequence.saturating_add(1))
}
