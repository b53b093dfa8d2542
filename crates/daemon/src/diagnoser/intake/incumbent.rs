//! Whose samples are diagnosed, when several publishers publish on the module's key.
//!
//! The one that is being diagnosed stays until it has been silent for a while. Samples of another one
//! are kept meanwhile, as many as fit, so that a restarted publisher loses nothing by the wait.
//! A client that forges a publisher's identity is kept out by access control, not by this.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use names::RunId;
use zenoh::session::EntityGlobalId;

use super::Arrival;

/// A publisher and its run; a publisher may be without an identity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Source {
    pub(super) publisher: Option<EntityGlobalId>,
    pub(super) run: RunId,
}

/// What to do with a sample.
#[derive(Debug)]
pub(super) enum Admission {
    /// Use it.
    Use(Arrival),
    /// Use these, the last one of which it is.
    UseAll(VecDeque<Arrival>),
    /// It is another publisher's; it was put aside or dropped.
    PutAside,
}

/// The publisher being diagnosed, and a candidate for its place.
#[derive(Debug)]
pub(super) struct Incumbent {
    present: Option<(Source, Instant)>,
    candidate: Option<(Source, VecDeque<Arrival>)>,
    hold: Duration,
    room: usize,
}

impl Incumbent {
    /// A publisher silent for `hold` may be replaced; `room` samples of another one are kept.
    pub(super) fn new(hold: Duration, room: usize) -> Self {
        Self { present: None, candidate: None, hold, room }
    }

    pub(super) fn admit(&mut self, source: Source, arrival: Arrival) -> Admission {
        let now = arrival.received;
        self.forget_silent_candidate();
        match self.present {
            Some((present, _)) if !self.is_replaced_by(present, source, now) => {
                self.put_aside(source, arrival);
                Admission::PutAside
            }
            Some((present, _)) if present != source => {
                self.present = Some((source, now));
                let mut samples = self.kept_of(source);
                samples.push_back(arrival);
                Admission::UseAll(samples)
            }
            _ => {
                self.present = Some((source, now));
                Admission::Use(arrival)
            }
        }
    }

    /// The samples put aside, if the present publisher has been silent for long enough; they are used
    /// from now on.
    pub(super) fn promote(&mut self, now: Instant) -> VecDeque<Arrival> {
        self.forget_silent_candidate();
        let silent = self.is_silent(now);
        match self.candidate.take_if(|_| silent) {
            Some((source, samples)) => {
                self.present = Some((source, now));
                samples
            }
            None => VecDeque::new(),
        }
    }

    /// A publisher with an identity may begin a new run at any time.
    fn is_replaced_by(&self, present: Source, source: Source, now: Instant) -> bool {
        let same = source.publisher.is_some() && source.publisher == present.publisher;
        source == present || same || self.is_silent(now)
    }

    /// Has the present publisher been silent for long enough to be replaced?
    fn is_silent(&self, now: Instant) -> bool {
        self.present.is_none_or(|(_, heard)| now.duration_since(heard) >= self.hold)
    }

    fn put_aside(&mut self, source: Source, arrival: Arrival) {
        if self.candidate.as_ref().is_some_and(|(candidate, _)| *candidate == source) {
            if let Some((_, samples)) = &mut self.candidate {
                if samples.len() == self.room {
                    samples.pop_front();
                }
                samples.push_back(arrival);
            }
        } else if !self.candidate_speaks(arrival.received) {
            self.candidate = Some((source, VecDeque::from([arrival])));
        }
    }

    fn candidate_speaks(&self, now: Instant) -> bool {
        let latest = self.candidate.as_ref().and_then(|(_, samples)| samples.back());
        latest.is_some_and(|latest| now.duration_since(latest.received) < self.hold)
    }

    /// A candidate that fell silent while the present one went on is dropped. If both are silent, one may
    /// have replaced the other and be waiting for an echo.
    fn forget_silent_candidate(&mut self) {
        let Some((_, heard)) = self.present else { return };
        if !self.candidate_speaks(heard) {
            self.candidate = None;
        }
    }

    fn kept_of(&mut self, source: Source) -> VecDeque<Arrival> {
        let kept = self.candidate.take_if(|(candidate, _)| *candidate == source);
        kept.map(|(_, samples)| samples).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use diagnosis::Sample;
    use names::Step;

    const HOLD: Duration = Duration::from_millis(200);

    struct Bench {
        incumbent: Incumbent,
        start: Instant,
    }

    impl Bench {
        fn new() -> Self {
            Self { incumbent: Incumbent::new(HOLD, 3), start: Instant::now() }
        }

        /// The steps used when a sample of this run comes at this time.
        fn take(&mut self, at_ms: u64, run: u64, step: u64) -> Vec<u64> {
            let run = RunId(run);
            let sample = Sample {
                run,
                step: Step(step),
                demands_n: vec![],
                pressures_pa: vec![],
                elongations_m: vec![],
            };
            let received = self.start + Duration::from_millis(at_ms);
            let arrival = Arrival { sample, time_unix_ns: 0, received };
            match self.incumbent.admit(Source { publisher: None, run }, arrival) {
                Admission::Use(arrival) => vec![arrival.sample.step.0],
                Admission::UseAll(all) => all.iter().map(|a| a.sample.step.0).collect(),
                Admission::PutAside => vec![],
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
        assert_eq!(bench.take(150, 2, 1), [0; 0]);
        assert_eq!(bench.take(201, 2, 2), [0, 1, 2]);
        assert_eq!(bench.take(202, 1, 8), [0; 0], "the former one has lost its place");
    }

    #[test]
    fn it_takes_its_place_even_if_it_waits_itself() {
        let mut bench = Bench::new();
        bench.take(0, 1, 7);
        bench.take(50, 2, 0);
        let at = |ms| bench.start + Duration::from_millis(ms);
        let (early, late) = (at(100), at(200));
        assert!(bench.incumbent.promote(early).is_empty());
        assert_eq!(bench.incumbent.promote(late).len(), 1);
        assert_eq!(bench.take(201, 2, 1), [1]);
    }

    #[test]
    fn a_candidate_that_falls_silent_while_the_first_one_goes_on_is_forgotten() {
        let mut bench = Bench::new();
        bench.take(0, 1, 0);
        bench.take(10, 2, 900);
        (1..10).for_each(|k| drop(bench.take(100 * k, 1, k)));
        let much_later = bench.start + Duration::from_secs(2);
        assert!(bench.incumbent.promote(much_later).is_empty());
        assert_eq!(bench.take(2001, 2, 901), [901], "without what it published before");
    }

    #[test]
    fn what_is_put_aside_is_bounded_and_the_latest_is_kept() {
        let mut bench = Bench::new();
        for step in 0..100 {
            bench.take(step, 1, step);
            bench.take(step, 2, step);
        }
        assert_eq!(bench.take(400, 2, 100), [97, 98, 99, 100]);
    }
}
