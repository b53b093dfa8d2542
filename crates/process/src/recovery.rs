//! Recovery of missed samples from the publisher: which samples in replies to use, and when to repeat a query.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use vocabulary::{ModuleName, SampleQuestion, Step};

use crate::sequencer::{ReceivedSample, SampleSize};

/// Timeout of a query. Samples delayed by packet loss may take longer, so the query is repeated.
const TIMEOUT: Duration = Duration::from_millis(500);
/// On a new link, samples may arrive before the network knows which publisher stores earlier ones. A query that reaches
/// no publisher, or none with samples, is repeated for this long.
const UNANSWERED_FOR: Duration = Duration::from_millis(250);
/// If a publisher was reachable before, queries are repeated until it has discarded the samples: a link that loses a
/// fifth of its packets may be down for seconds.
const OUTAGE: Duration = Duration::from_secs(8);

/// The samples received for one question, possibly by several queries: at most one sample per step.
#[derive(Debug)]
pub struct SampleRecovery {
    module: ModuleName,
    size: SampleSize,
    question: SampleQuestion,
    samples: BTreeMap<Step, ReceivedSample>,
}

impl SampleRecovery {
    /// Of a module with samples of this size.
    #[must_use]
    pub fn new(module: &ModuleName, size: SampleSize, question: SampleQuestion) -> Self {
        Self { module: module.clone(), size, question, samples: BTreeMap::new() }
    }

    /// Adds a sample that was requested. Returns whether it was.
    pub fn take(&mut self, sample: vocabulary::Sample, now: Instant) -> bool {
        let fits = sample.module == self.module
            && sample.run == self.question.run
            && (self.question.from..=self.question.to).contains(&sample.step);
        if fits {
            let arrival = ReceivedSample::new(sample, now, self.size);
            self.samples.entry(arrival.sample.step).or_insert(arrival);
        }
        fits
    }

    /// The samples still missing; samples arrive oldest first.
    #[must_use]
    pub fn rest(&self) -> Option<SampleQuestion> {
        let SampleQuestion { from, to, .. } = self.question;
        let from = self.samples.keys().next_back().map_or(from, |latest| latest.plus(1));
        (from <= to).then_some(SampleQuestion { from, ..self.question })
    }

    /// The number of samples received.
    #[must_use]
    pub fn count(&self) -> usize {
        self.samples.len()
    }

    /// The samples received, sorted by step.
    pub fn end(&mut self) -> Vec<ReceivedSample> {
        std::mem::take(&mut self.samples).into_values().collect()
    }
}

/// A query that did not return all samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecoveryAttempt {
    /// When it was sent.
    pub asked: Instant,
    /// Whether it returned samples.
    pub brought_some: bool,
    /// Whether a publisher that stores samples was reachable, before and after the query.
    pub reached: (bool, bool),
    /// Whether such a publisher was ever known, even if it is not reachable at present.
    pub is_known: bool,
}

impl RecoveryAttempt {
    /// Whether publishers that store samples are missing, or have none of these. Otherwise more may follow: some
    /// arrived, or the link failed or is still down.
    fn found_nothing(&self, now: Instant) -> bool {
        match self.reached {
            _ if self.brought_some => false,
            // A publisher that was reachable throughout and answered with nothing before the timeout has none of the
            // samples.
            (true, true) => now.duration_since(self.asked) < TIMEOUT,
            (false, false) => !self.is_known,
            _ => false,
        }
    }
}

/// Decides when to repeat the query for the samples of a gap.
#[derive(Debug)]
pub struct RecoveryRetries {
    began: Instant,
    nothing_since: Option<Instant>,
}

impl RecoveryRetries {
    /// The network's own time limit for a query.
    pub const TIMEOUT: Duration = TIMEOUT;
    /// The pause before a query is repeated.
    pub const PAUSE: Duration = Duration::from_millis(50);
    /// Time limit of all queries together. Zenoh's own timeout comes first, so that nothing waits for late samples;
    /// this one applies if Zenoh fails to keep its timeout.
    pub const LIMIT: Duration = Duration::from_millis(8000 + 500 + 700);

    /// The state before the first query.
    #[must_use]
    pub fn starting(now: Instant) -> Self {
        Self { began: now, nothing_since: None }
    }

    /// Decides whether to ask again after a query that ended `now`.
    pub fn again(&mut self, attempt: RecoveryAttempt, now: Instant) -> bool {
        if attempt.found_nothing(now) {
            let since = *self.nothing_since.get_or_insert(attempt.asked);
            now.duration_since(since) <= UNANSWERED_FOR
        } else {
            self.nothing_since = None;
            now.duration_since(self.began) < OUTAGE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vocabulary::RunId;

    const SIZE: SampleSize = SampleSize { actuators: 0, gages: 0 };
    const MS: Duration = Duration::from_millis(1);

    fn sample(module: &str, run: u64, step: u64) -> vocabulary::Sample {
        vocabulary::Sample {
            module: module.parse().unwrap(),
            run: RunId(run),
            step: Step(step),
            time_unix_ns: 5,
            demands_n: vec![],
            pressures_pa: vec![],
            elongations_m: vec![],
            readings: vec![],
            block: Vec::new(),
        }
    }

    #[test]
    fn there_is_room_for_what_was_asked_for_once_and_for_nothing_else() {
        let question = SampleQuestion { run: RunId(1), from: Step(1), to: Step(3) };
        let mut recovery = SampleRecovery::new(&"m1".parse().unwrap(), SIZE, question);
        let now = Instant::now();
        for other in [sample("m2", 1, 1), sample("m1", 2, 1)] {
            assert!(!recovery.take(other, now));
        }
        assert_eq!(recovery.rest().map(|rest| rest.from), Some(Step(1)));
        for step in [0, 1, 1, 2, 4, 2] {
            assert_eq!(recovery.take(sample("m1", 1, step), now), (1..=3).contains(&step));
        }
        assert_eq!(recovery.rest().map(|rest| (rest.from, rest.to)), Some((Step(3), Step(3))));
        assert!(recovery.take(sample("m1", 1, 3), now));
        assert_eq!((recovery.rest(), recovery.count()), (None, 3));
        let steps: Vec<u64> = recovery.end().iter().map(|arrival| arrival.sample.step.0).collect();
        assert_eq!(steps, [1, 2, 3]);
    }

    fn attempt(asked: Instant, found_nothing: bool) -> RecoveryAttempt {
        let reached = (true, found_nothing);
        RecoveryAttempt { asked, brought_some: false, reached, is_known: true }
    }

    #[test]
    fn a_finished_symptom_differs_from_an_interrupted_one() {
        let (asked, soon) = (Instant::now(), 10 * MS);
        for (brought_some, reached, is_known, took, nothing) in [
            (true, (true, true), true, soon, false),
            (false, (true, true), true, soon, true),
            (false, (true, true), true, TIMEOUT, false),
            (false, (false, false), false, soon, true),
            (false, (false, false), true, soon, false),
            (false, (false, true), true, soon, false),
            (false, (true, false), true, soon, false),
        ] {
            let attempt = RecoveryAttempt { asked, brought_some, reached, is_known };
            assert_eq!(attempt.found_nothing(asked + took), nothing, "{attempt:?}, {took:?}");
        }
    }

    /// Queries that take so long each, of which the first so many are cut off: when no more are made.
    fn given_up_after(duration: Duration, cut_off: usize) -> Duration {
        let began = Instant::now();
        let mut now = began;
        let mut retries = RecoveryRetries::starting(now);
        for count in 0..10_000 {
            let asked = now;
            now += duration;
            if !retries.again(attempt(asked, count >= cut_off), now) {
                return now - began;
            }
            now += RecoveryRetries::PAUSE;
        }
        panic!("endless")
    }

    fn assert_about(found: Duration, wanted: Duration, query: Duration) {
        assert!((wanted..=wanted + query + 50 * MS).contains(&found), "{found:?}, not {wanted:?}");
    }

    #[test]
    fn without_a_publisher_that_keeps_samples_it_is_soon_given_up() {
        // however busy the machine is
        for query in [MS, 60 * MS] {
            assert_about(given_up_after(query, 0), UNANSWERED_FOR, query);
        }
    }

    #[test]
    fn a_link_that_is_lost_is_waited_for() {
        assert_about(given_up_after(MS, usize::MAX), OUTAGE, MS);
        let query = 400 * MS;
        assert_about(given_up_after(query, usize::MAX), OUTAGE, query);
    }

    #[test]
    fn once_it_is_back_and_has_nothing_it_is_not_asked_for_long() {
        // ten queries at 51 ms each
        assert_about(given_up_after(MS, 10), 510 * MS + UNANSWERED_FOR, MS);
    }
}
