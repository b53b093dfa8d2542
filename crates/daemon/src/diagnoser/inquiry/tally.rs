//! The outcomes of queries.

use std::sync::atomic::{AtomicU64, Ordering};

use vocabulary::InquiryCounters;

/// InquiryTally that every queryable shares.
#[derive(Debug, Default)]
pub(crate) struct InquiryTally {
    received: AtomicU64,
    malformed: AtomicU64,
    turned_away: AtomicU64,
    answered: AtomicU64,
    refused: AtomicU64,
    orders_obeyed: AtomicU64,
    orders_refused: AtomicU64,
}

impl InquiryTally {
    pub(crate) fn received(&self) {
        count(&self.received);
    }

    pub(crate) fn malformed(&self) {
        count(&self.malformed);
    }

    pub(crate) fn turned_away(&self) {
        count(&self.turned_away);
    }

    pub(crate) fn answered(&self) {
        count(&self.answered);
    }

    pub(crate) fn refused(&self) {
        count(&self.refused);
    }

    /// The question is answered when the reply is sent.
    pub(crate) fn order_obeyed(&self) {
        count(&self.orders_obeyed);
    }

    /// An order refused is a question refused.
    pub(crate) fn order_refused(&self) {
        count(&self.orders_refused);
        self.refused();
    }

    pub(crate) fn read(&self) -> InquiryCounters {
        let read = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        InquiryCounters {
            received: read(&self.received),
            malformed: read(&self.malformed),
            turned_away: read(&self.turned_away),
            answered: read(&self.answered),
            refused: read(&self.refused),
            orders_obeyed: read(&self.orders_obeyed),
            orders_refused: read(&self.orders_refused),
        }
    }
}

fn count(counter: &AtomicU64) {
    counter.fetch_add(1, Ordering::Relaxed);
}
