//! Queries and commands without a reply so far.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use diagnosis::{OrderToken, QuestionToken};

/// A peer's query that waits for its step.
#[derive(Debug)]
struct HeldQuery<Q> {
    query: Q,
    until: Instant,
}

/// The token of a command for which no client waits; no pending command has it.
pub const UNAWAITED: OrderToken = OrderToken(0);

/// A command that waits for its outcome.
#[derive(Debug)]
pub struct PendingOrder<Q> {
    /// The query to reply to.
    pub query: Q,
    /// Whether it applies to the whole module.
    pub is_of_module: bool,
}

/// The pending queries and commands.
#[derive(Debug)]
pub struct PendingReplies<Q> {
    questions: BTreeMap<QuestionToken, HeldQuery<Q>>,
    orders: BTreeMap<OrderToken, PendingOrder<Q>>,
    hold: Duration,
    next: u64,
}

impl<Q> PendingReplies<Q> {
    /// Queries are held for at most `hold`.
    #[must_use]
    pub fn new(hold: Duration) -> Self {
        Self { questions: BTreeMap::new(), orders: BTreeMap::new(), hold, next: 0 }
    }

    /// How long queries are held.
    #[must_use]
    pub fn hold(&self) -> Duration {
        self.hold
    }

    /// Adds a query.
    pub fn put_question(&mut self, query: Q, now: Instant) -> QuestionToken {
        self.next += 1;
        let token = QuestionToken(self.next);
        self.questions.insert(token, HeldQuery { query, until: now + self.hold });
        token
    }

    /// Removes a query.
    pub fn take_question(&mut self, token: QuestionToken) -> Option<Q> {
        self.questions.remove(&token).map(|held| held.query)
    }

    /// The queries held for too long; all of them if `all`.
    #[must_use]
    pub fn expired(&self, now: Instant, all: bool) -> Vec<QuestionToken> {
        let expired = self.questions.iter().filter(|(_, held)| all || held.until <= now);
        expired.map(|(token, _)| *token).collect()
    }

    /// Adds a command.
    pub fn put_order(&mut self, order: PendingOrder<Q>) -> OrderToken {
        self.next += 1;
        let token = OrderToken(self.next);
        self.orders.insert(token, order);
        token
    }

    /// Removes a command.
    pub fn take_order(&mut self, token: OrderToken) -> Option<PendingOrder<Q>> {
        self.orders.remove(&token)
    }
}
