//! Counts over all kills.

use std::fmt;
use std::time::Duration;

use vocabulary::{FaultState, FaultTransition};

use super::audit::Audit;
use super::collection::Collected;
use super::logs::Lives;
use super::operator::Books;

/// The numbers.
#[derive(Debug, Clone)]
pub struct Summary {
    /// Number of processes killed.
    pub kills: usize,
    /// How long it took.
    pub took: Duration,
    /// Transitions in the histories.
    pub transitions: usize,
    /// Transitions that a subscriber received live.
    pub seen: usize,
    /// Messages received for them.
    pub messages: usize,
    /// Faults that were found.
    pub latched: usize,
    /// Changes that were explained.
    pub explained: usize,
    /// Changes that could not be judged, temporarily or permanently.
    pub unconfirmed: usize,
    /// Commands obeyed.
    pub obeyed: usize,
    /// Commands refused.
    pub refused: usize,
    /// Commands without a reply.
    pub unanswered: usize,
    /// How often a diagnoser was ready.
    pub ready: usize,
    /// Records that a kill cut short.
    pub torn_tails: usize,
}

impl Summary {
    /// Counts.
    #[must_use]
    pub fn of(
        (kills, took): (usize, Duration),
        audits: &[Audit],
        collected: &Collected,
        books: &Books,
        lives: &[Lives],
    ) -> Self {
        let transitions: Vec<&FaultTransition> =
            audits.iter().flat_map(|audit| &audit.history.transitions).collect();
        let count = |state| transitions.iter().filter(|one| one.state() == state).count();
        Self {
            kills,
            took,
            transitions: transitions.len(),
            seen: collected.transitions.len(),
            messages: collected.messages,
            latched: count(FaultState::Latched),
            explained: count(FaultState::Explained),
            unconfirmed: count(FaultState::Unconfirmed),
            obeyed: books.done.len(),
            refused: books.refused,
            unanswered: books.unanswered,
            ready: lives.iter().map(|lives| lives.ready).sum(),
            torn_tails: lives.iter().map(|lives| lives.torn_tails).sum(),
        }
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kills, transitions, seen, messages, ready, torn_tails, .. } = self;
        let Self { latched, explained, unconfirmed, obeyed, refused, unanswered, .. } = self;
        writeln!(f, "{kills} kills in {:.0} s:", self.took.as_secs_f64())?;
        writeln!(f, "  ready {ready} times, {torn_tails} torn tails")?;
        writeln!(f, "  {transitions} transitions, {seen} seen as they came, {messages} messages")?;
        writeln!(f, "  {latched} latched, {explained} explained, {unconfirmed} unconfirmed")?;
        write!(f, "  orders: {obeyed} obeyed, {refused} refused, {unanswered} not answered")
    }
}
