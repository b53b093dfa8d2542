//! When the publisher is asked again for samples that were missed.

use std::time::{Duration, Instant};

/// Where a link is new, samples may come before the network knows who keeps the earlier ones. A query that
/// reaches nobody, or nobody who has any, is repeated for so long.
const UNANSWERED_FOR: Duration = Duration::from_millis(250);
/// A publisher that was reached, and is not any more, is waited for until it has forgotten the samples; a link
/// that loses a fifth of its packets may be down for seconds.
pub(super) const OUTAGE: Duration = Duration::from_secs(8);

/// What a query came to that did not bring all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outcome {
    /// Somebody who keeps samples may have more: some came, or the link failed, or is not back yet.
    CutOff,
    /// Nobody keeps samples, or nobody has any of these.
    Nothing,
}

/// What the queries for one gap came to so far.
#[derive(Debug)]
pub(super) struct RetryPolicy {
    began: Instant,
    nothing_since: Option<Instant>,
}

impl RetryPolicy {
    pub(super) fn starting(now: Instant) -> Self {
        Self { began: now, nothing_since: None }
    }

    /// Decides whether to ask again after a query of the time `asked` that ended `now`.
    pub(super) fn again(&mut self, asked: Instant, now: Instant, outcome: Outcome) -> bool {
        match outcome {
            Outcome::CutOff => {
                self.nothing_since = None;
                now.duration_since(self.began) < OUTAGE
            }
            Outcome::Nothing => {
                let since = *self.nothing_since.get_or_insert(asked);
                now.duration_since(since) <= UNANSWERED_FOR
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    /// Queries that take so long each, of which the first so many are cut off: when no more are made.
    fn given_up_after(duration: Duration, cut_off: usize) -> Duration {
        let began = Instant::now();
        let mut now = began;
        let mut retries = RetryPolicy::starting(now);
        for count in 0..10_000 {
            let asked = now;
            now += duration;
            let outcome = if count < cut_off { Outcome::CutOff } else { Outcome::Nothing };
            if !retries.again(asked, now, outcome) {
                return now - began;
            }
            now += 50 * MS;
        }
        panic!("endless")
    }

    fn assert_about(found: Duration, wanted: Duration, query: Duration) {
        assert!((wanted..=wanted + query + 50 * MS).contains(&found), "{found:?}, not {wanted:?}");
    }

    #[test]
    fn nobody_keeps_samples() {
        // however busy the machine is
        for query in [MS, 60 * MS] {
            assert_about(given_up_after(query, 0), UNANSWERED_FOR, query);
        }
    }

    #[test]
    fn a_link_that_is_lost_is_waited_for() {
        assert_about(given_up_after(MS, usize::MAX), OUTAGE, MS);
        let query = 500 * MS;
        assert_about(given_up_after(query, usize::MAX), OUTAGE, query);
    }

    #[test]
    fn once_it_is_back_and_has_nothing_it_is_not_asked_for_long() {
        // ten queries at 51 ms each
        assert_about(given_up_after(MS, 10), 510 * MS + UNANSWERED_FOR, MS);
    }
}
