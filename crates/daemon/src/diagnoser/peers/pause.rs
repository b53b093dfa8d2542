//! The pause of sample processing while this module's own queries to peers are pending.

use std::time::Duration;

use tokio::time::Instant;

/// The pending queries.
#[derive(Debug)]
pub(crate) struct QueryPause {
    under_way: usize,
    /// Samples wait until then.
    pub(crate) until: Option<Instant>,
    pause: Duration,
}

impl QueryPause {
    /// Samples wait for `pause` at most.
    pub(crate) fn new(pause: Duration) -> Self {
        Self { under_way: 0, until: None, pause }
    }

    /// A query begins.
    pub(crate) fn begin(&mut self) {
        if self.under_way == 0 {
            self.until = Some(Instant::now() + self.pause);
        }
        self.under_way += 1;
    }

    /// A query ended.
    pub(crate) fn end(&mut self) {
        self.under_way = self.under_way.saturating_sub(1);
        if self.under_way == 0 {
            self.until = None;
        }
    }
}
