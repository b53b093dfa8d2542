//! Orders recovered samples before those that arrived meanwhile.
//!
//! If steps are missing, the publisher is queried for them, and later samples wait. It is also queried when the first
//! sample of a run arrives, so that a restarted diagnoser receives the samples that it missed and has a complete
//! interval at once.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use diagnosis::Measurements;
use vocabulary::{
    RunId, SampleQuestion, Step,
    delivery::{Due, GapFiller},
};

/// A sample with its times of publishing and arrival.
#[derive(Debug, Clone)]
pub struct ReceivedSample {
    /// The sample.
    pub sample: Measurements,
    /// When it was published, by the publisher's clock \[ns since 1970\].
    pub time_unix_ns: u64,
    /// The time of arrival.
    pub received: Instant,
}

/// The number of values in a sample of the module.
#[derive(Debug, Clone, Copy)]
pub struct SampleSize {
    /// Actuators.
    pub actuators: usize,
    /// Gages.
    pub gages: usize,
}

impl ReceivedSample {
    /// A sample of one step. One that is too long is truncated one value beyond its expected length: it stays too long, but takes no
    /// more memory than a valid one, however many are queued.
    #[must_use]
    pub fn new(sample: vocabulary::Sample, received: Instant, size: SampleSize) -> Self {
        let vocabulary::Sample {
            module: _,
            run,
            step,
            time_unix_ns,
            mut demands_n,
            mut pressures_pa,
            mut elongations_m,
            readings,
            block: _,
        } = sample;
        // A module has gages, or the channels of a learned module; what has both is too long.
        elongations_m.extend(readings);
        cut(&mut demands_n, size.actuators);
        cut(&mut pressures_pa, size.actuators);
        cut(&mut elongations_m, size.gages);
        let sample = Measurements { run, step, demands_n, pressures_pa, elongations_m };
        Self { sample, time_unix_ns, received }
    }
}

fn cut<T>(values: &mut Vec<T>, length: usize) {
    if values.len() > length {
        values.truncate(length + 1);
        values.shrink_to_fit();
    }
}

/// A longer gap is not filled: the diagnoser does not accept such a jump of steps at once.
const LONGEST_GAP: u64 = 10_000;
/// Pause before the next query after one without an answer, or after the backlog was dropped.
const RESPITE: Duration = Duration::from_secs(1);
/// A sample that has waited this long for a reason other than the publisher's reply shows that the diagnoser has no
/// time to recover samples.
const HURRY: Duration = Duration::from_secs(1);

/// The next action.
#[derive(Debug)]
pub enum SequencerStep {
    /// Diagnose this sample.
    Process(ReceivedSample),
    /// Query the publisher.
    Fetch(SampleQuestion),
}

/// Samples queued for the diagnosis.
#[derive(Debug)]
pub struct Sequencer {
    /// The number of past samples to request.
    depth: u64,
    room: usize,
    /// The missing samples, and the sample that revealed the gap.
    filler: GapFiller<ReceivedSample>,
    /// Samples that arrived after that one.
    waiting: VecDeque<ReceivedSample>,
    asked: Option<SampleQuestion>,
    /// The time of the latest reply, until which samples waited for it.
    replied: Option<Instant>,
    respite: Option<Instant>,
}

impl Sequencer {
    /// Requests at most `depth` samples; at most `room` samples wait meanwhile.
    #[must_use]
    pub fn new(depth: u64, room: usize) -> Self {
        Self {
            depth,
            room,
            filler: GapFiller::default(),
            waiting: VecDeque::new(),
            asked: None,
            replied: None,
            respite: None,
        }
    }

    /// Adds a sample that arrived.
    pub fn push(&mut self, arrival: ReceivedSample) {
        // A publisher that has started a new run has discarded the former one.
        let forgotten = self.asked.is_some_and(|question| question.run != arrival.sample.run);
        self.waiting.push_back(arrival);
        let too_long = self.len() >= self.room;
        if too_long || forgotten {
            self.give_up();
        }
    }

    /// Adds the samples that the publisher still had; returns whether they were still awaited.
    pub fn take(
        &mut self,
        question: SampleQuestion,
        samples: Vec<ReceivedSample>,
        now: Instant,
    ) -> bool {
        if self.asked != Some(question) {
            return false;
        }
        self.replied = Some(now);
        if samples.is_empty() {
            self.respite = Some(now + RESPITE);
        }
        for arrival in samples {
            // A duplicate is ignored.
            let _ = self.filler.take(arrival.sample.step.0, arrival);
        }
        self.give_up();
        true
    }

    /// Stops waiting for the missing samples.
    fn give_up(&mut self) {
        if self.asked.take().is_some() {
            self.filler.give_up(0..self.filler.end());
        }
    }

    /// Drops all waiting samples; returns their number. Samples missing before them will not be requested.
    pub fn clear(&mut self, now: Instant) -> usize {
        let thrown = self.len();
        self.filler = GapFiller::default();
        self.waiting.clear();
        self.asked = None;
        self.respite = Some(now + RESPITE);
        thrown
    }

    /// Whether a reply of the publisher is pending. Samples that wait for it do not indicate overload.
    #[must_use]
    pub fn is_owed(&self) -> bool {
        self.asked.is_some()
    }

    /// The number of waiting samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.filler.held().len() + self.waiting.len()
    }

    /// The next action, given the latest sample diagnosed.
    pub fn next(&mut self, last: Option<(RunId, Step)>, now: Instant) -> Option<SequencerStep> {
        while let Some(due) = self.filler.due() {
            // The diagnoser counts lost steps.
            if let Due::Item(_, arrival) = due {
                return Some(SequencerStep::Process(arrival));
            }
        }
        if self.asked.is_some() {
            return None;
        }
        let front = self.waiting.pop_front()?;
        let step = front.sample.step;
        let missing = self.missing(last, (front.sample.run, step));
        let Some(question) = missing.filter(|_| self.may_ask(&front, now)) else {
            return Some(SequencerStep::Process(front));
        };
        self.filler = GapFiller::starting_at(question.from.0);
        let _ = self.filler.take(step.0, front);
        self.asked = Some(question);
        Some(SequencerStep::Fetch(question))
    }

    /// Whether there is time to recover samples.
    fn may_ask(&self, front: &ReceivedSample, now: Instant) -> bool {
        let ready = self.replied.map_or(front.received, |replied| replied.max(front.received));
        let hurry = now.duration_since(ready) >= HURRY;
        self.respite.is_none_or(|until| until <= now) && !hurry
    }

    fn missing(
        &self,
        last: Option<(RunId, Step)>,
        (run, step): (RunId, Step),
    ) -> Option<SampleQuestion> {
        let oldest = step.minus(self.depth);
        let from = match last {
            Some((present, last)) if present == run => {
                if step <= last || step.since(last) > LONGEST_GAP {
                    return None;
                }
                oldest.max(last.plus(1))
            }
            _ => oldest,
        };
        // The greatest number does not denote a step.
        (from < step && step.0 < u64::MAX).then(|| SampleQuestion { run, from, to: step.minus(1) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arrival(run: u64, step: u64, received: Instant) -> ReceivedSample {
        let sample = Measurements {
            run: RunId(run),
            step: Step(step),
            demands_n: vec![],
            pressures_pa: vec![],
            elongations_m: vec![],
        };
        ReceivedSample { sample, time_unix_ns: 0, received }
    }

    struct Bench {
        sequencer: Sequencer,
        now: Instant,
        last: Option<(RunId, Step)>,
        asked: Vec<SampleQuestion>,
    }

    impl Bench {
        fn new() -> Self {
            let sequencer = Sequencer::new(100, 50);
            Self { sequencer, now: Instant::now(), last: None, asked: Vec::new() }
        }

        fn push(&mut self, run: u64, step: u64) -> Vec<u64> {
            self.sequencer.push(arrival(run, step, self.now));
            self.flow()
        }

        fn answer(&mut self, steps: impl IntoIterator<Item = u64>) -> Vec<u64> {
            let question = *self.asked.last().unwrap();
            let samples = steps.into_iter().map(|step| arrival(question.run.0, step, self.now));
            assert!(self.sequencer.take(question, samples.collect(), self.now));
            self.flow()
        }

        fn flow(&mut self) -> Vec<u64> {
            let mut processed = Vec::new();
            while let Some(flow) = self.sequencer.next(self.last, self.now) {
                match flow {
                    SequencerStep::Process(arrival) => {
                        processed.push(arrival.sample.step.0);
                        self.last = Some((arrival.sample.run, arrival.sample.step));
                    }
                    SequencerStep::Fetch(question) => self.asked.push(question),
                }
            }
            processed
        }

        fn steps_asked(&self) -> Vec<(u64, u64)> {
            self.asked.iter().map(|question| (question.from.0, question.to.0)).collect()
        }
    }

    #[test]
    fn without_a_gap_no_query_is_made() {
        let mut bench = Bench::new();
        for step in 0..10 {
            assert_eq!(bench.push(1, step), [step]);
        }
        assert_eq!(bench.push(1, 9), [9], "a repeated one is for the diagnoser to count");
        assert!(bench.asked.is_empty());
    }

    #[test]
    fn what_is_missing_comes_before_what_came_meanwhile() {
        let mut bench = Bench::new();
        bench.push(1, 0);
        assert_eq!(bench.push(1, 4), [0; 0]);
        assert_eq!(bench.push(1, 5), [0; 0]);
        assert_eq!(bench.steps_asked(), [(1, 3)]);
        assert_eq!(bench.answer([1, 2, 3]), [1, 2, 3, 4, 5]);
        assert_eq!(bench.push(1, 6), [6]);
    }

    #[test]
    fn the_first_sample_of_a_run_asks_for_what_was_before() {
        let mut bench = Bench::new();
        assert_eq!(bench.push(1, 1000), [0; 0]);
        assert_eq!(bench.steps_asked(), [(900, 999)]);
        assert_eq!(bench.answer(950..1000), (950..=1000).collect::<Vec<_>>());
        assert_eq!(bench.push(2, 3), [0; 0]);
        assert_eq!(bench.steps_asked()[1], (0, 2));
    }

    #[test]
    fn a_publisher_that_keeps_nothing_is_not_asked_all_the_time() {
        let mut bench = Bench::new();
        bench.push(1, 0);
        bench.push(1, 4);
        assert_eq!(bench.answer([]), [4]);
        assert_eq!(bench.push(1, 8), [8]);
        bench.now += RESPITE;
        assert_eq!(bench.push(1, 12), [0; 0]);
        assert_eq!(bench.steps_asked(), [(1, 3), (9, 11)]);
    }

    #[test]
    fn a_slow_publisher_is_not_waited_for_when_there_is_no_room() {
        let mut bench = Bench::new();
        bench.push(1, 0);
        let mut processed = Vec::new();
        for step in 4..54 {
            processed.extend(bench.push(1, step));
        }
        assert_eq!(processed, (4..54).collect::<Vec<_>>());
        let late = bench.asked[0];
        assert!(!bench.sequencer.take(late, vec![arrival(1, 2, bench.now)], bench.now));
    }

    #[test]
    fn a_second_gap_behind_a_slow_answer_is_asked_for_too() {
        let mut bench = Bench::new();
        bench.push(1, 0);
        bench.push(1, 4);
        bench.push(1, 8);
        bench.now += 2 * HURRY;
        assert_eq!(bench.answer([1, 2, 3]), [1, 2, 3, 4]);
        assert_eq!(bench.steps_asked(), [(1, 3), (5, 7)]);
        assert_eq!(bench.answer([5, 6, 7]), [5, 6, 7, 8]);
    }

    #[test]
    fn samples_of_a_finished_run_are_not_awaited() {
        let mut bench = Bench::new();
        bench.push(1, 0);
        assert_eq!(bench.push(1, 4), [0; 0]);
        assert_eq!(bench.push(2, 0), [4, 0]);
    }

    #[test]
    fn who_is_late_for_want_of_speed_does_not_look_back() {
        let mut bench = Bench::new();
        bench.push(1, 0);
        let received = bench.now;
        bench.now += 2 * HURRY;
        bench.sequencer.push(arrival(1, 4, received));
        assert_eq!(bench.flow(), [4]);
        assert!(bench.asked.is_empty());
    }

    #[test]
    fn an_absurd_step_is_no_gap_and_a_backlog_thrown_away_is_not_asked_for() {
        let mut bench = Bench::new();
        bench.push(1, 0);
        assert_eq!(bench.push(1, u64::MAX), [u64::MAX]);
        bench.last = Some((RunId(1), Step(0)));
        bench.push(1, 9);
        assert_eq!(bench.sequencer.clear(bench.now), 1);
        assert_eq!(bench.push(1, 20), [20]);
    }

    #[test]
    fn a_sample_that_is_too_long_stays_so_but_takes_no_room() {
        let sample = vocabulary::Sample {
            module: "m".parse().unwrap(),
            run: RunId(1),
            step: Step(1),
            time_unix_ns: 0,
            demands_n: vec![1.0],
            pressures_pa: vec![[1.0; 2]; 2],
            elongations_m: vec![1.0; 100_000],
            readings: vec![1.0; 1000],
            block: Vec::new(),
        };
        let size = SampleSize { actuators: 2, gages: 3 };
        let ReceivedSample { sample, .. } = ReceivedSample::new(sample, Instant::now(), size);
        let lengths =
            (sample.demands_n.len(), sample.pressures_pa.len(), sample.elongations_m.len());
        assert_eq!(lengths, (1, 2, 4));
        assert!(sample.elongations_m.capacity() < 10);
    }
}
