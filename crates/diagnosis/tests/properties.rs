//! What holds whatever comes.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "test code")]

mod definition;
mod fixture;

use definition::{Definition, error_in_tolerances};
use diagnosis::divergence::{DivergenceBank, DivergenceSettings, Interval, Outcome};
use diagnosis::{
    Action, Answer, Change, Event, PeerFailure, Question, QuestionToken, Rule, Verdict,
};
use fixture::{Bench, name};
use proptest::prelude::*;
use truss::ids::{RunId, Step};

fn settings(window: usize, lag: usize, interval: usize) -> DivergenceSettings {
    let interval = match interval {
        0 => Interval::Growing,
        vectors => Interval::Sliding { vectors },
    };
    DivergenceSettings { window, lag, interval }
}

fn divergences(bank: &mut DivergenceBank, samples: &[f64]) -> Vec<Option<f64>> {
    samples.iter().map(|x| bank.push(&[*x])[0].divergence()).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..Default::default() })]

    #[test]
    fn the_divergence_agrees_with_its_definition_for_any_setting(
        window in 1_usize..12,
        lag in 1_usize..12,
        interval in prop_oneof![Just(0_usize), 8_usize..40],
        scale in -9_i32..3,
        samples in prop::collection::vec(-1.0..1.0_f64, 60..90),
    ) {
        let scale = 10_f64.powi(scale);
        let samples: Vec<f64> = samples.iter().map(|x| scale * x).collect();
        let prior_scatter = 0.01 * scale * scale;
        let definition = Definition { window, lag, interval, prior_scatter };
        let mut bank = DivergenceBank::new(settings(window, lag, interval), &[prior_scatter]).unwrap();
        let found = divergences(&mut bank, &samples);
        for index in (0..samples.len()).rev().step_by(13) {
            let expected = definition.divergence(&samples, index);
            prop_assert_eq!(found[index].is_some(), expected.is_some());
            if let (Some(found), Some(expected)) = (found[index], expected) {
                prop_assert!(error_in_tolerances(found, expected) <= 1.0, "{} {}", found, expected);
            }
        }
    }

    #[test]
    fn channels_never_touch_each_other(
        samples in prop::collection::vec(prop::array::uniform5(-1e3..1e3_f64), 30..60),
    ) {
        let setting = settings(4, 3, 12);
        let mut together = DivergenceBank::new(setting, &[0.1; 5]).unwrap();
        let mut alone: Vec<_> = (0..5).map(|_| DivergenceBank::new(setting, &[0.1]).unwrap()).collect();
        for sample in &samples {
            let outcomes = together.push(sample).to_vec();
            for (channel, bank) in alone.iter_mut().enumerate() {
                prop_assert_eq!(bank.push(&sample[channel..=channel])[0], outcomes[channel]);
            }
        }
    }

    #[test]
    fn a_divergence_is_never_negative_nor_infinite_whatever_comes(
        samples in prop::collection::vec(any::<f64>(), 30..120),
    ) {
        let mut bank = DivergenceBank::new(settings(3, 2, 10), &[1e-6]).unwrap();
        for sample in samples {
            if let Outcome::Defined { divergence, .. } = bank.push(&[sample])[0] {
                prop_assert!(divergence.is_finite() && divergence >= 0.0);
            }
        }
    }

    #[test]
    fn after_rubbish_a_channel_comes_back_as_if_it_had_just_started(
        rubbish in prop::collection::vec(-1e200..1e200_f64, 1..40),
        samples in prop::collection::vec(-1.0..1.0_f64, 60),
    ) {
        let mut bank = DivergenceBank::new(settings(3, 2, 10), &[1e-6]).unwrap();
        divergences(&mut bank, &rubbish);
        bank.restart();
        let mut new = DivergenceBank::new(settings(3, 2, 10), &[1e-6]).unwrap();
        prop_assert_eq!(divergences(&mut bank, &samples), divergences(&mut new, &samples));
    }
}

/// Something that may happen to a diagnoser.
#[derive(Debug, Clone)]
enum Happening {
    Samples(u8),
    Fault { gage: usize, offset_m: f64 },
    Pressure { actuator: usize, offset_pa: f64 },
    Gap(u8),
    Repeat,
    NotANumber,
    NewRun,
    Asked { from: u64, as_of: u64, run: u64 },
    Withdrawn(u64),
    Answered { lie: u8, changes: Vec<(u64, f64)> },
    Unanswered,
}

fn happening() -> impl Strategy<Value = Happening> {
    prop_oneof![
        8 => (1..40_u8).prop_map(Happening::Samples),
        2 => (0..3_usize, -1e-4..1e-4_f64)
            .prop_map(|(gage, offset_m)| Happening::Fault { gage, offset_m }),
        1 => (0..2_usize, -1e6..1e6_f64)
            .prop_map(|(actuator, offset_pa)| Happening::Pressure { actuator, offset_pa }),
        1 => (1..20_u8).prop_map(Happening::Gap),
        1 => Just(Happening::Repeat),
        1 => Just(Happening::NotANumber),
        1 => Just(Happening::NewRun),
        2 => (0..2000_u64, 0..2000_u64, 1..3_u64)
            .prop_map(|(from, as_of, run)| Happening::Asked { from, as_of, run }),
        1 => (0..20_u64).prop_map(Happening::Withdrawn),
        4 => (0..4_u8, prop::collection::vec((0..2000_u64, 0.5..1e6_f64), 0..3))
            .prop_map(|(lie, changes)| Happening::Answered { lie, changes }),
        2 => Just(Happening::Unanswered),
    ]
}

/// Drives a diagnoser and remembers whether its peer has answered what was asked.
struct Driver {
    bench: Bench,
    token: u64,
    outstanding: Option<Question>,
    seen: usize,
    /// Steps as of which the peer has answered truly.
    answered_until: Option<Step>,
}

impl Driver {
    fn apply(&mut self, happening: Happening) {
        match happening {
            Happening::Samples(count) => self.bench.run(u64::from(count)),
            Happening::Fault { gage, offset_m } => self.bench.signals.gage_offsets[gage] = offset_m,
            Happening::Pressure { actuator, offset_pa } => {
                self.bench.signals.pressure_offsets[actuator] = offset_pa;
            }
            Happening::Gap(count) => {
                self.bench.signals.step = self.bench.signals.step.plus(u64::from(count));
            }
            Happening::Repeat => {
                let mut sample = self.bench.signals.clone().sample();
                sample.step = sample.step.minus(1);
                self.bench.give(Event::Sample(sample));
            }
            Happening::NotANumber => {
                let mut sample = self.bench.signals.sample();
                sample.elongations_m[1] = f64::NAN;
                self.bench.give(Event::Sample(sample));
            }
            Happening::NewRun => {
                self.bench.signals.run = RunId(self.bench.signals.run.0 + 1);
                self.bench.signals.step = Step(0);
                self.outstanding = None;
                self.answered_until = None;
            }
            Happening::Asked { from, as_of, run } => {
                self.token += 1;
                let question = Question { run: RunId(run), from: Step(from), as_of: Step(as_of) };
                self.bench.give(Event::Asked { token: QuestionToken(self.token), question });
            }
            Happening::Withdrawn(token) => {
                self.bench.give(Event::Withdrawn { token: QuestionToken(token) });
            }
            Happening::Answered { lie, changes } => self.answer(lie, &changes),
            Happening::Unanswered => {
                if let Some(question) = self.outstanding.take() {
                    let failure = PeerFailure::TimedOut;
                    self.bench.give(Event::Unanswered { peer: name("upper"), question, failure });
                }
            }
        }
        self.look();
    }

    fn answer(&mut self, lie: u8, changes: &[(u64, f64)]) {
        let Some(question) = self.outstanding.take() else { return };
        let change = |&(step, ratio): &(u64, f64)| {
            let component = "actuator/a1".parse().unwrap();
            Change { component, step: Step(step), ratio }
        };
        let mut changes: Vec<_> = changes.iter().map(change).collect();
        if lie > 0 {
            changes
                .retain(|c| (question.from..=question.as_of).contains(&c.step) && c.ratio >= 1.0);
            changes.sort_by_key(|c| c.step);
        }
        let watching_since = Some(Step(0));
        let answer = Answer { question, watching_since, changes, actuator_faults: Vec::new() };
        let malformed = self.bench.diagnoser.counters().answers_malformed;
        self.bench.give(Event::Answered { peer: name("upper"), answer });
        if self.bench.diagnoser.counters().answers_malformed == malformed {
            self.answered_until = Some(question.as_of);
        }
    }

    /// Reads the new actions and holds them against what must always be true.
    fn look(&mut self) {
        for action in &self.bench.actions[self.seen..] {
            match action {
                Action::Ask { question, .. } => {
                    assert!(self.outstanding.is_none(), "one question at a time");
                    self.outstanding = Some(*question);
                }
                Action::Publish(transition) if transition.verdict.is_latched() => {
                    let known = self.answered_until.expect("committed without an answer");
                    assert!(known >= transition.decided, "committed on too old an answer");
                }
                _ => {}
            }
        }
        self.seen = self.bench.actions.len();
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..Default::default() })]

    #[test]
    fn invariants_hold_for_any_sequence_of_events(
        happenings in prop::collection::vec(happening(), 1..80),
    ) {
        let run = || {
            let bench = Bench::in_service("lower", Rule::FirstChange);
            let mut driver =
                Driver { bench, token: 0, outstanding: None, seen: 0, answered_until: None };
            happenings.iter().cloned().for_each(|happening| driver.apply(happening));
            driver.bench
        };
        let bench = run();
        let transitions = bench.transitions();
        let mut latched = std::collections::BTreeSet::new();
        for (index, transition) in transitions.iter().enumerate() {
            prop_assert_eq!(transition.sequence, index as u64 + 1, "contiguous");
            prop_assert!(!latched.contains(&transition.component), "latched stays latched");
            if transition.verdict == Verdict::Latched {
                latched.insert(transition.component.clone());
            }
            prop_assert!(transition.onset <= transition.detection);
        }
        prop_assert_eq!(&run().actions, &bench.actions, "same events, same actions");
    }
}
