//! Samples that were missed and that the publisher is asked for: what of the replies is used, and when it is asked again.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use vocabulary::{ModuleName, SampleQuestion, Step};

use crate::sequencer::{ReceivedSample, SampleSize};

/// How long the network waits for the samples. What is lost on the way may take longer, so it is asked again.
const TIMEOUT: Duration = Duration::from_millis(500);
/// Where a link is new, samples may come before the network knows who keeps the earlier ones. A query that
/// reaches no publisher, or none that has any, is repeated for so long.
const UNANSWERED_FOR: Duration = Duration::from_millis(250);
/// A publisher that was reached, and is not any more, is waited for until it has forgotten the samples; a link
/// that loses a fifth of its packets may be down for seconds.
const OUTAGE: Duration = Duration::from_secs(8);

/// The samples of one question, which several queries may bring: there is room for one sample of each step.
#[derive(Debug)]
pub struct SampleRecovery {
    module: ModuleName,
    size: SampleSize,
    question: SampleQuestion,
    samples: BTreeMap<Step, ReceivedSample>,
}

impl SampleRecovery {
    /// Of a module whose samples have this size.
    #[must_use]
    pub fn new(module: &ModuleName, size: SampleSize, question: SampleQuestion) -> Self {
        Self { module: module.clone(), size, question, samples: BTreeMap::new() }
    }

    /// Takes a sample, unless it was not asked for. Returns whether it was.
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

    /// What has not come yet; samples come oldest first.
    #[must_use]
    pub fn rest(&self) -> Option<SampleQuestion> {
        let SampleQuestion { from, to, .. } = self.question;
        let from = self.samples.keys().next_back().map_or(from, |latest| latest.plus(1));
        (from <= to).then_some(SampleQuestion { from, ..self.question })
    }

    /// How many have come.
    #[must_use]
    pub fn count(&self) -> usize {
        self.samples.len()
    }

    /// What has come, sorted by step.
    pub fn end(&mut self) -> Vec<ReceivedSample> {
        std::mem::take(&mut self.samples).into_values().collect()
    }
}

/// A query that did not bring all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecoveryAttempt {
    /// When it was put.
    pub asked: Instant,
    /// Whether it brought samples.
    pub brought_some: bool,
    /// Whether the network knew of a publisher that keeps samples, before the query and after it.
    pub reached: (bool, bool),
    /// Whether it ever knew of one, who may be out of reach at present.
    pub is_known: bool,
}

impl RecoveryAttempt {
    /// Is there no publisher that keeps samples, or none that has any of these? Otherwise more may come: some came, or the
    /// link failed, or is not back yet.
    fn found_nothing(&self, now: Instant) -> bool {
        match self.reached {
            _ if self.brought_some => false,
            // One that is there all the time and has sent nothing in time has nothing.
            (true, true) => now.duration_since(self.asked) < TIMEOUT,
            (false, false) => !self.is_known,
            _ => false,
        }
    }
}

/// When the publisher is asked again for the samples of one gap.
#[derive(Debug)]
pub struct RecoveryRetries {
    began: Instant,
    nothing_since: Option<Instant>,
}

impl RecoveryRetries {
    /// The network's own time limit for a query.
    pub const TIMEOUT: Duration = TIMEOUT;
    /// The pause before it is asked again.
    pub const PAUSE: Duration = Duration::from_millis(50);
    /// All queries together end within this time. The network's own time limit comes first, so that nothing waits for late
    /// samples; this one is for a network that fails to keep it.
    pub const LIMIT: Duration = Duration::from_millis(8000 + 500 + 700);

    /// Before the first query.
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
    fn what_came_to_nothing_is_told_from_what_was_cut_off() {
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
