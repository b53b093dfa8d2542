//! Questions and orders whose replies are still to come.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use diagnosis::{OrderToken, QuestionToken};
use zenoh::query::Query;

/// A peer's question that waits for its step.
#[derive(Debug)]
struct Held {
    query: Query,
    until: Instant,
}

/// What is on the desk.
#[derive(Debug)]
pub(crate) struct Desk {
    questions: HashMap<QuestionToken, Held>,
    orders: HashMap<OrderToken, Query>,
    hold: Duration,
    next: u64,
}

impl Desk {
    /// Questions are held for at most `hold`.
    pub(crate) fn new(hold: Duration) -> Self {
        Self { questions: HashMap::new(), orders: HashMap::new(), hold, next: 0 }
    }

    pub(crate) fn patience(&self) -> Duration {
        self.hold
    }

    /// Puts a question onto the desk.
    pub(crate) fn put_question(&mut self, query: Query) -> QuestionToken {
        self.next += 1;
        let token = QuestionToken(self.next);
        self.questions.insert(token, Held { query, until: Instant::now() + self.hold });
        token
    }

    /// Takes a question off the desk.
    pub(crate) fn take_question(&mut self, token: QuestionToken) -> Option<Query> {
        self.questions.remove(&token).map(|held| held.query)
    }

    /// The questions that have waited too long; all of them if `all`.
    pub(crate) fn expired(&self, now: Instant, all: bool) -> Vec<QuestionToken> {
        let expired = self.questions.iter().filter(|(_, held)| all || held.until <= now);
        expired.map(|(token, _)| *token).collect()
    }

    /// Puts an order onto the desk.
    pub(crate) fn put_order(&mut self, query: Query) -> OrderToken {
        self.next += 1;
        let token = OrderToken(self.next);
        self.orders.insert(token, query);
        token
    }

    /// Takes an order off the desk.
    pub(crate) fn take_order(&mut self, token: OrderToken) -> Option<Query> {
        self.orders.remove(&token)
    }
}
