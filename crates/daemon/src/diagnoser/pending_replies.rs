//! Queries and commands that have not been replied to yet.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use diagnosis::{OrderToken, QuestionToken};
use zenoh::query::Query;

/// A peer's query that waits for its step.
#[derive(Debug)]
struct Held {
    query: Query,
    until: Instant,
}

/// What a command that nobody waits for is passed in with; nothing pending has this token.
pub(crate) const UNAWAITED: OrderToken = OrderToken(0);

/// A command that waits for its outcome.
#[derive(Debug)]
pub(crate) struct PendingOrder {
    pub(crate) query: Query,
    /// Whether it is about the module with all its components.
    pub(crate) is_of_module: bool,
}

/// The pending queries and commands.
#[derive(Debug)]
pub(crate) struct PendingReplies {
    questions: HashMap<QuestionToken, Held>,
    orders: HashMap<OrderToken, PendingOrder>,
    hold: Duration,
    next: u64,
}

impl PendingReplies {
    /// Queries are held for at most `hold`.
    pub(crate) fn new(hold: Duration) -> Self {
        Self { questions: HashMap::new(), orders: HashMap::new(), hold, next: 0 }
    }

    pub(crate) fn hold(&self) -> Duration {
        self.hold
    }

    /// Adds a query.
    pub(crate) fn put_question(&mut self, query: Query) -> QuestionToken {
        self.next += 1;
        let token = QuestionToken(self.next);
        self.questions.insert(token, Held { query, until: Instant::now() + self.hold });
        token
    }

    /// Removes a query.
    pub(crate) fn take_question(&mut self, token: QuestionToken) -> Option<Query> {
        self.questions.remove(&token).map(|held| held.query)
    }

    /// The queries held for too long; all of them if `all`.
    pub(crate) fn expired(&self, now: Instant, all: bool) -> Vec<QuestionToken> {
        let expired = self.questions.iter().filter(|(_, held)| all || held.until <= now);
        expired.map(|(token, _)| *token).collect()
    }

    /// Adds a command.
    pub(crate) fn put_order(&mut self, order: PendingOrder) -> OrderToken {
        self.next += 1;
        let token = OrderToken(self.next);
        self.orders.insert(token, order);
        token
    }

    /// Removes a command.
    pub(crate) fn take_order(&mut self, token: OrderToken) -> Option<PendingOrder> {
        self.orders.remove(&token)
    }
}
