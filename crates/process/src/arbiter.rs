//! Selects the publisher whose samples are diagnosed, if several publish on the module's key.
//!
//! The selected publisher stays until it has been silent for a while. Samples of another one are buffered meanwhile,
//! within limits, so that the wait loses no samples of a restarted publisher. Only time during which the diagnoser was
//! listening counts as silence: after the diagnoser was suspended, every publisher seems silent, and which samples it
//! reads first is chance. Access control, not this module, excludes clients that forge a publisher's identity.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crate::sequencer::ReceivedSample;
use vocabulary::RunId;

/// The identity of a publisher on the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PublisherId {
    /// The identifier of its session.
    pub session: [u8; 16],
    /// The identifier of the publisher within the session.
    pub entity: u32,
}

/// A publisher and its run; the publisher may have no identity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SampleSource {
    /// The publisher.
    pub publisher: Option<PublisherId>,
    /// The run that it publishes.
    pub run: RunId,
}

impl SampleSource {
    /// Whether samples in the other source's reply belong to this source. Publisher and queryable are different
    /// entities of one session. If the publisher has no identity, any reply with the same run is accepted, as are its
    /// published samples.
    #[must_use]
    pub fn replies_as(self, replier: SampleSource) -> bool {
        match self.publisher {
            Some(publisher) => replier.publisher.is_some_and(|id| id.session == publisher.session),
            None => self.run == replier.run,
        }
    }
}

/// The decision about a sample.
#[derive(Debug)]
pub enum Arbitration {
    /// Use it.
    Use(ReceivedSample),
    /// Use these samples, which end with the new one.
    UseAll(VecDeque<ReceivedSample>),
    /// The sample belongs to another publisher; it was buffered or dropped.
    PutAside,
}

/// The time spent listening. A pause between two messages or ticks counts for at most [`Self::PAUSE`].
#[derive(Debug, Default)]
struct ListeningTime {
    latest: Option<Instant>,
    time: Duration,
}

impl ListeningTime {
    /// Several ticks of the diagnosis loop.
    const PAUSE: Duration = Duration::from_millis(50);

    fn until(&mut self, now: Instant) -> Duration {
        let pause = self.latest.map_or(Duration::ZERO, |latest| now.duration_since(latest));
        self.latest = self.latest.max(Some(now));
        self.time += pause.min(Self::PAUSE);
        self.time
    }
}

/// Another publisher, the time of its latest sample, and its buffered samples.
#[derive(Debug)]
struct CandidateSource {
    source: SampleSource,
    heard: Duration,
    samples: VecDeque<ReceivedSample>,
}

/// The selected publisher, the time of its latest sample, and a candidate to replace it.
#[derive(Debug)]
pub struct PublisherArbiter {
    listening: ListeningTime,
    present: Option<(SampleSource, Duration)>,
    candidate: Option<CandidateSource>,
    hold: Duration,
    room: usize,
}

impl PublisherArbiter {
    /// A publisher may be replaced after `hold` of silence; up to `room` samples of the candidate are buffered.
    #[must_use]
    pub fn new(hold: Duration, room: usize) -> Self {
        Self { listening: ListeningTime::default(), present: None, candidate: None, hold, room }
    }

    /// Decides about a sample.
    pub fn admit(&mut self, source: SampleSource, arrival: ReceivedSample) -> Arbitration {
        let now = self.listening.until(arrival.received);
        self.forget_silent_candidate();
        match self.present {
            Some((present, _)) if !self.is_replaced_by(present, source, now) => {
                self.put_aside(source, arrival, now);
                Arbitration::PutAside
            }
            Some((present, _)) if present != source => {
                self.present = Some((source, now));
                let mut samples = self.kept_of(source);
                samples.push_back(arrival);
                Arbitration::UseAll(samples)
            }
            _ => {
                self.present = Some((source, now));
                Arbitration::Use(arrival)
            }
        }
    }

    /// If the selected publisher has been silent for long enough, selects the candidate and returns its buffered
    /// samples.
    pub fn promote(&mut self, now: Instant) -> VecDeque<ReceivedSample> {
        let now = self.listening.until(now);
        self.forget_silent_candidate();
        let silent = self.is_silent(now);
        match self.candidate.take_if(|_| silent) {
            Some(CandidateSource { source, samples, .. }) => {
                self.present = Some((source, now));
                samples
            }
            None => VecDeque::new(),
        }
    }

    /// The selected publisher.
    #[must_use]
    pub fn present(&self) -> Option<SampleSource> {
        self.present.map(|(source, _)| source)
    }

    /// A publisher with an identity may start a new run at any time.
    fn is_replaced_by(&self, present: SampleSource, source: SampleSource, now: Duration) -> bool {
        let same = source.publisher.is_some() && source.publisher == present.publisher;
        source == present || same || self.is_silent(now)
    }

    /// Whether the selected publisher has been silent for long enough to be replaced.
    fn is_silent(&self, now: Duration) -> bool {
        self.present.is_none_or(|(_, heard)| now - heard >= self.hold)
    }

    fn put_aside(&mut self, source: SampleSource, arrival: ReceivedSample, now: Duration) {
        let speaks = self.candidate_speaks(now);
        match &mut self.candidate {
            Some(candidate) if candidate.source == source => {
                candidate.heard = now;
                if candidate.samples.len() == self.room {
                    candidate.samples.pop_front();
                }
                candidate.samples.push_back(arrival);
            }
            _ if speaks => {}
            candidate => {
                let samples = VecDeque::from([arrival]);
                *candidate = Some(CandidateSource { source, heard: now, samples });
            }
        }
    }

    fn candidate_speaks(&self, now: Duration) -> bool {
        let heard = self.candidate.as_ref().map(|candidate| candidate.heard);
        heard.is_some_and(|heard| now.saturating_sub(heard) < self.hold)
    }

    /// Drops a candidate that became silent while the selected publisher continued. If both are silent, the candidate
    /// may be the successor and be waiting for its samples to be diagnosed.
    fn forget_silent_candidate(&mut self) {
        let Some((_, heard)) = self.present else { return };
        if !self.candidate_speaks(heard) {
            self.candidate = None;
        }
    }

    fn kept_of(&mut self, source: SampleSource) -> VecDeque<ReceivedSample> {
        let kept = self.candidate.take_if(|candidate| candidate.source == source);
        kept.map(|candidate| candidate.samples).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use diagnosis::Measurements;
    use vocabulary::Step;

    const HOLD: Duration = Duration::from_millis(200);

    struct Bench {
        arbiter: PublisherArbiter,
        start: Instant,
    }

    impl Bench {
        fn new() -> Self {
            Self { arbiter: PublisherArbiter::new(HOLD, 3), start: Instant::now() }
        }

        fn at(&self, ms: u64) -> Instant {
            self.start + Duration::from_millis(ms)
        }

        /// Listens until then without a pause.
        fn listen(&mut self, until_ms: u64) {
            let listening = &mut self.arbiter.listening;
            for ms in (0..=until_ms).step_by(10) {
                let at = self.start + Duration::from_millis(ms);
                if listening.latest.is_none_or(|latest| latest < at) {
                    listening.until(at);
                }
            }
        }

        /// The steps used when a sample of this run comes at this time.
        fn take(&mut self, at_ms: u64, run: u64, step: u64) -> Vec<u64> {
            let run = RunId(run);
            let sample = Measurements {
                run,
                step: Step(step),
                demands_n: vec![],
                pressures_pa: vec![],
                elongations_m: vec![],
            };
            let received = self.at(at_ms);
            let arrival = ReceivedSample { sample, time_unix_ns: 0, received };
            match self.arbiter.admit(SampleSource { publisher: None, run }, arrival) {
                Arbitration::Use(arrival) => vec![arrival.sample.step.0],
                Arbitration::UseAll(all) => all.iter().map(|a| a.sample.step.0).collect(),
                Arbitration::PutAside => vec![],
            }
        }
    }

    #[test]
    fn the_first_one_stays_as_long_as_it_speaks() {
        let mut bench = Bench::new();
        for k in 0..10 {
            assert_eq!(bench.take(100 * k, 1, k), [k]);
            assert_eq!(bench.take(100 * k + 50, 2, k), [0; 0]);
        }
    }

    #[test]
    fn once_it_is_silent_another_one_takes_its_place_and_loses_nothing() {
        let mut bench = Bench::new();
        bench.take(0, 1, 7);
        assert_eq!(bench.take(50, 2, 0), [0; 0]);
        bench.listen(150);
        assert_eq!(bench.take(150, 2, 1), [0; 0]);
        bench.listen(200);
        assert_eq!(bench.take(201, 2, 2), [0, 1, 2]);
        assert_eq!(bench.take(202, 1, 8), [0; 0], "the former one has lost its place");
    }

    #[test]
    fn it_takes_its_place_even_if_it_waits_itself() {
        let mut bench = Bench::new();
        bench.take(0, 1, 7);
        bench.take(50, 2, 0);
        let (early, late) = (bench.at(100), bench.at(200));
        assert!(bench.arbiter.promote(early).is_empty());
        bench.listen(190);
        assert_eq!(bench.arbiter.promote(late).len(), 1);
        assert_eq!(bench.take(201, 2, 1), [1]);
    }

    #[test]
    fn a_diagnoser_that_stood_still_declares_no_peer_silent() {
        let mut bench = Bench::new();
        bench.take(0, 1, 7);
        for (at_ms, step) in [(400, 8), (800, 9)] {
            assert_eq!(bench.take(at_ms, 2, 0), [0; 0], "whose samples are read first is chance");
            assert_eq!(bench.take(at_ms + 1, 1, step), [step]);
        }
    }

    #[test]
    fn a_candidate_that_falls_silent_while_the_first_one_goes_on_is_forgotten() {
        let mut bench = Bench::new();
        bench.take(0, 1, 0);
        bench.take(10, 2, 900);
        for k in 1..10 {
            bench.listen(100 * k);
            bench.take(100 * k, 1, k);
        }
        bench.listen(2000);
        let much_later = bench.at(2000);
        assert!(bench.arbiter.promote(much_later).is_empty());
        assert_eq!(bench.take(2001, 2, 901), [901], "without what it published before");
    }

    #[test]
    fn what_is_put_aside_is_bounded_and_the_latest_is_kept() {
        let mut bench = Bench::new();
        for step in 0..100 {
            bench.take(step, 1, step);
            bench.take(step, 2, step);
        }
        bench.listen(400);
        assert_eq!(bench.take(400, 2, 100), [97, 98, 99, 100]);
    }
}
