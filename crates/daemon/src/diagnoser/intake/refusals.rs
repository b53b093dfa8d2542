//! Samples that arrive and are not used: the reason why nothing is known.

use std::time::{Duration, Instant};

use parking_lot::{Mutex, MutexGuard};

/// Refusals are counted by spans of this length.
const SPAN: Duration = Duration::from_secs(1);

/// The latest refusals, noted by the network's callback and by the diagnosis.
#[derive(Debug, Default)]
pub(crate) struct Refusals(Mutex<Option<Latest>>);

#[derive(Debug)]
struct Latest {
    reason: String,
    at: Instant,
    span_began: Instant,
    in_span: u64,
    in_span_before: Option<u64>,
}

impl Refusals {
    /// A sample was refused.
    pub(crate) fn note(&self, reason: String, now: Instant) {
        let mut lock = self.lock();
        let latest = lock.get_or_insert_with(|| Latest::begins(now));
        latest.count(now);
        latest.reason = reason;
    }

    /// Why samples have been refused within the last `span`, and how many in a second.
    pub(crate) fn present(&self, now: Instant, span: Duration) -> Option<String> {
        let lock = self.lock();
        let latest = lock.as_ref().filter(|latest| now.duration_since(latest.at) < span)?;
        let Latest { reason, in_span, in_span_before, .. } = latest;
        let rate = in_span_before.unwrap_or(*in_span);
        Some(format!("samples arrive and are refused: {reason} ({rate} a second)"))
    }

    /// Every change is made whole or not at all, so a thread that failed has left it in order.
    fn lock(&self) -> MutexGuard<'_, Option<Latest>> {
        self.0.lock()
    }
}

impl Latest {
    fn begins(now: Instant) -> Self {
        Self { reason: String::new(), at: now, span_began: now, in_span: 0, in_span_before: None }
    }

    fn count(&mut self, now: Instant) {
        let spans = now.duration_since(self.span_began).as_nanos() / SPAN.as_nanos();
        if spans > 0 {
            self.in_span_before = (spans == 1).then_some(self.in_span);
            self.span_began = now;
            self.in_span = 0;
        }
        self.in_span += 1;
        self.at = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn the_reason_is_the_latest_and_the_rate_that_of_the_last_second() {
        let refusals = Refusals::default();
        let start = Instant::now();
        assert_eq!(refusals.present(start, SPAN), None);
        for ms in 0..1500 {
            refusals.note("wrong number of values".to_owned(), start + ms * MS);
        }
        let now = start + 1500 * MS;
        let expected = "samples arrive and are refused: wrong number of values (1000 a second)";
        assert_eq!(refusals.present(now, 500 * MS).as_deref(), Some(expected));
        assert_eq!(refusals.present(now + 500 * MS, 500 * MS), None, "they have stopped");
    }
}
