//! Verdicts that depend on a peer's answer. The component that changed first is the faulty one, so a peer whose
//! component explains a local change must raise the alarm itself: it is queried once more, and its answer is discarded
//! if it has not.

use vocabulary::{ComponentPath, ModuleName, StateAnswer, Step, delivery::Backoff};

use super::case::Case;

/// How often the peer is asked. It has judged its own change by the first time, unless it waits for others; so after
/// every answer in which it does not raise the alarm it is asked after twice as long.
const ASKED_TIMES: u32 = 4;

/// How often it may say that its own change is not judged yet, since it waits for others, before that counts as no alarm.
/// One that catches up passes seconds of steps before its questions time out.
const PENDING_TIMES: u32 = 8;

/// Most claims of one channel. What comes beyond rests on those that are open.
const MAX_CLAIMS: usize = 8;

/// A change that a peer's component explains, if the peer stands by it.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
struct Claim {
    case: Case,
    by: ComponentPath,
    since: Step,
    pauses: Backoff<u64>,
    /// Until it is asked again that has not judged yet.
    pending: Backoff<u64>,
    ask_at: Step,
}

/// What a peer's answer makes of its word.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Word {
    /// It raises the alarm itself.
    Kept,
    /// It does not: nothing explains the case.
    Broken(ComponentPath),
    /// It no longer has the record, so the claim cannot be checked.
    Forgotten(ModuleName),
}

/// The verdicts that rest on a peer's word, until it has been kept.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Claims {
    open: Vec<Claim>,
    pauses: Backoff<u64>,
    pending: Backoff<u64>,
}

impl Claims {
    /// The peer is asked for the first time after so many steps.
    pub(super) fn new(first: u64) -> Self {
        let pauses = Backoff::new(first, first << ASKED_TIMES);
        Self { open: Vec::new(), pauses, pending: Backoff::new(first, first << PENDING_TIMES) }
    }

    pub(super) fn clear(&mut self) {
        self.open.clear();
    }

    /// A channel's claims are over: an operator has decided.
    pub(super) fn close_all_of(&mut self, channel: usize) {
        self.open.retain(|claim| claim.case.channel != channel);
    }

    /// Opens a claim: the case was judged an effect of the change of a peer's component at `since`.
    pub(super) fn open(&mut self, case: Case, by: ComponentPath, since: Step) {
        let channel = case.channel;
        let of_channel = self.open.iter().filter(|claim| claim.case.channel == channel);
        let (count, known) = of_channel
            .fold((0, false), |(count, known), claim| (count + 1, known || claim.by == by));
        if !known && count < MAX_CLAIMS {
            let mut pauses = self.pauses;
            let ask_at = case.decide_at.plus(pauses.fail());
            let pending = self.pending;
            self.open.push(Claim { case, by, since, pauses, pending, ask_at });
        }
    }

    /// Does the verdict on a channel rest on a peer's word?
    pub(crate) fn are_open(&self, channel: usize) -> bool {
        self.open.iter().any(|claim| claim.case.channel == channel)
    }

    /// Is any peer to be asked at this step?
    pub(super) fn is_any_due(&self, now: Step) -> bool {
        self.open.iter().any(|claim| claim.ask_at <= now)
    }

    /// As of which step a peer is to be asked, if at all.
    pub(super) fn due_of(&self, peer: &ModuleName, now: Step) -> Option<Step> {
        let due = self.open.iter().filter(|claim| claim.by.module == *peer && claim.ask_at <= now);
        due.map(|claim| claim.ask_at).max()
    }

    /// What a peer's answer makes of the claims that rest on its word.
    pub(super) fn check(&mut self, answer: &StateAnswer) -> Vec<(Case, Word)> {
        let mut words = Vec::new();
        self.open.retain_mut(|claim| {
            let is_asked =
                claim.by.module == answer.module && claim.ask_at <= answer.question.as_of;
            let word = if is_asked { claim.check(answer) } else { None };
            let is_open = word.is_none();
            words.extend(word.map(|word| (claim.case.clone(), word)));
            is_open
        });
        words
    }
}

impl Claim {
    /// `None` as long as the peer may have its reasons.
    fn check(&mut self, answer: &StateAnswer) -> Option<Word> {
        if answer.alarms.iter().any(|alarm| alarm.component == self.by.component) {
            return Some(Word::Kept);
        }
        if answer.watching_since.is_none_or(|since| since > self.since) {
            return Some(Word::Forgotten(self.by.module.clone()));
        }
        let as_of = answer.question.as_of;
        let is_pending = answer.pending.contains(&self.by.component);
        if is_pending && self.pending.failures() < PENDING_TIMES {
            self.ask_at = as_of.plus(self.pending.fail());
            return None;
        }
        self.ask_at = as_of.plus(self.pauses.fail());
        (self.pauses.failures() > ASKED_TIMES).then(|| Word::Broken(self.by.clone()))
    }
}
