//! A diagnoser that is restarted takes up where it left off.

use crate::fixture::{Bench, HOLD, WARM_UP, name, quiet};
use diagnosis::messages::{from_diagnoser, to_diagnoser};
use diagnosis::{
    Action, Doubt, Event, PeerFailure, QuestionToken, Refusal, Rule, StateQuestion, Verdict,
};
use vocabulary::ModulePhase;
use vocabulary::{RunId, StatePart, Step};

const BIAS_M: f64 = 50e-6;

/// A bias in gage g1 whose question is under way.
fn open_question() -> (Bench, StateQuestion) {
    let mut bench = Bench::in_service("lower", Rule::FirstChange);
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(HOLD + 1);
    let question = bench.questions()[0].1;
    (bench, question)
}

#[test]
fn latched_faults_and_the_sequence_are_those_of_before() {
    let (mut bench, question) = open_question();
    bench.give(quiet(question));
    let restarted = bench.restarted();
    assert_eq!(restarted.latched(), ["sensor/g1"]);
    assert_eq!(restarted.diagnoser.next_sequence(), bench.diagnoser.next_sequence());
    assert_eq!(restarted.diagnoser.phase(), ModulePhase::Waiting);
}

#[test]
fn with_the_missed_samples_replayed_nothing_is_reported_twice_and_nothing_is_missed() {
    let (mut bench, question) = open_question();
    bench.give(quiet(question));
    let published = bench.transitions().len();
    let mut again = bench.restarted();
    // the publisher still has everything from long before, and the samples of the time in between
    again.signals = bench.signals_of_the_start();
    again.run(WARM_UP + 100);
    again.signals.gage_offsets[0] = BIAS_M;
    again.run(600);
    assert_eq!(again.transitions().len(), 0, "{:?}", again.transitions());
    assert!(published > 0 && again.latched() == ["sensor/g1"]);
    again.signals.gage_offsets[2] = 20.0 * BIAS_M;
    again.run(HOLD + 1);
    let question = again.questions().last().unwrap().1;
    again.give(quiet(question));
    assert_eq!(again.latched(), ["sensor/g1", "sensor/g3"]);
    assert_eq!(again.transitions()[0].sequence, bench.diagnoser.next_sequence());
}

#[test]
fn a_change_that_was_not_judged_is_judged_after_the_restart() {
    let (bench, _) = open_question();
    let mut again = bench.restarted();
    assert_eq!(again.verdict("sensor/g1"), Verdict::Tentative);
    again.signals = bench.signals_of_the_start();
    again.run(WARM_UP + 100);
    again.signals.gage_offsets[0] = BIAS_M;
    again.run(HOLD + 1);
    let question = again.questions()[0].1;
    again.give(quiet(question));
    assert_eq!(again.story("sensor/g1"), ["latched"]);
    let latched = again.transitions()[0].clone();
    let tentative = bench.transitions()[0].clone();
    assert_eq!((latched.detection, latched.sequence), (tentative.detection, 2));
}

#[test]
fn without_the_samples_in_between_it_is_never_judged_but_unconfirmed() {
    let mut bench = Bench::in_service("lower", Rule::FirstChange);
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(HOLD - 2);
    assert_eq!(bench.verdict("sensor/g1"), Verdict::Tentative);
    let mut again = bench.restarted();
    again.signals = bench.signals.clone();
    again.signals.step = again.signals.step.plus(1000);
    again.run(WARM_UP + 100);
    let doubt = Doubt::Unknowing(vec![name("lower")]);
    assert_eq!(again.verdict("sensor/g1"), Verdict::Unconfirmed { doubt });
    assert_eq!(again.latched(), [""; 0]);
}

#[test]
fn peers_are_answered_from_before_the_restart_and_refused_what_is_not_known() {
    let (bench, _) = open_question();
    let last = bench.now();
    let mut again = bench.restarted();
    let mut ask = |run, as_of| {
        let question = StateQuestion { run: RunId(run), from: Step(0), as_of, window: None };
        again.give(Event::Asked { token: QuestionToken(1), question });
        again.actions.pop().unwrap()
    };
    let Action::Answer { answer, .. } = ask(1, last) else { panic!() };
    assert_eq!(answer.changes[0].component.to_string(), "sensor/g1");
    assert!(answer.watching_since.unwrap() <= answer.changes[0].step);
    let Action::Refuse { refusal, .. } = ask(1, last.plus(1)) else { panic!() };
    assert_eq!(refusal, Refusal::NoSample);
    let Action::Refuse { refusal, .. } = ask(2, last) else { panic!() };
    assert_eq!(refusal, Refusal::NoSample);
    again.signals.step = last.plus(500);
    again.run(WARM_UP + 100);
    let question =
        StateQuestion { run: RunId(1), from: Step(0), as_of: last.plus(10), window: None };
    again.give(Event::Asked { token: QuestionToken(1), question });
    let Action::Answer { answer, .. } = again.actions.pop().unwrap() else { panic!() };
    assert_eq!(answer.watching_since, None, "nothing was watched then");
}

#[test]
fn after_a_restart_into_another_run_what_was_open_stays_unconfirmed_until_reset() {
    let (bench, _) = open_question();
    let mut again = bench.restarted();
    again.signals.run = RunId(9);
    again.run(WARM_UP + 1000);
    let doubt = Doubt::RunEnded;
    assert_eq!(again.verdict("sensor/g1"), Verdict::Unconfirmed { doubt });
    assert_eq!(again.story("sensor/g1"), ["unconfirmed"]);
}

#[test]
fn a_fault_of_before_the_publisher_began_again_with_the_same_run_raises_its_alarm_after_a_restart()
{
    let (mut bench, question) = open_question();
    bench.give(quiet(question));
    let found = bench.now();
    bench.signals.step = Step(0);
    bench.run(WARM_UP + 80);
    assert!(bench.now() < found);
    let alarms = |bench: &mut Bench| {
        let question =
            StateQuestion { run: RunId(1), from: Step(0), as_of: bench.now(), window: None };
        bench.give(Event::Asked { token: QuestionToken(1), question });
        let Some(Action::Answer { answer, .. }) = bench.actions.pop() else { panic!() };
        let alarms = answer.alarms.into_iter();
        alarms.map(|alarm| (alarm.component.to_string(), alarm.step.0, alarm.faulty)).collect()
    };
    let raised: Vec<(String, u64, bool)> = alarms(&mut bench);
    assert_eq!(raised, [("sensor/g1".to_owned(), 0, true)]);
    let mut again = bench.restarted();
    again.signals = bench.signals.clone();
    again.run(1);
    assert_eq!(alarms(&mut again), raised);
}

#[test]
fn a_peer_that_returns_is_asked_at_once() {
    let (mut bench, question) = open_question();
    let failure = PeerFailure::Absent;
    bench.give(Event::Unanswered { peer: name("upper"), question, failure });
    bench.run(3);
    assert_eq!(bench.questions().len(), 1);
    bench.give(Event::Returned { peer: name("upper") });
    let questions = bench.questions();
    assert_eq!(questions.len(), 2);
    bench.give(quiet(questions[1].1));
    assert_eq!(bench.story("sensor/g1"), ["tentative", "unconfirmed", "latched"]);
}

fn about() -> StatePart {
    StatePart { software: env!("CARGO_PKG_VERSION").to_owned(), ..StatePart::default() }
}

/// Of a state that was written and read, everything is the same, and what comes of it later as well.
#[test]
fn a_state_that_was_written_and_read_goes_on_bit_for_bit() {
    for rule in [Rule::FirstChange, Rule::Paper] {
        let mut bench = Bench::in_service("lower", rule);
        for step in 0..600 {
            bench.signals.gage_offsets[0] = if step < 100 { 0.0 } else { BIAS_M };
            bench.run(1);
            if step % 97 != 13 {
                continue;
            }
            let parts = from_diagnoser(&bench.diagnoser, &about());
            let mut read = to_diagnoser(&parts.iter().collect::<Vec<_>>()).unwrap();
            assert_eq!(format!("{read:?}"), format!("{:?}", bench.diagnoser));
            let (mut actions, mut others) = (Vec::new(), Vec::new());
            let mut original = bench.diagnoser.clone();
            let mut signals = bench.signals.clone();
            for _ in 0..300 {
                let sample = signals.sample();
                original.take_sample(&sample, &mut actions);
                read.take_sample(&sample, &mut others);
            }
            assert_eq!(format!("{others:?}"), format!("{actions:?}"));
            assert_eq!(format!("{read:?}"), format!("{original:?}"));
        }
    }
}

#[test]
fn a_state_that_is_not_whole_or_of_another_version_is_refused() {
    let bench = Bench::in_service("lower", Rule::FirstChange);
    let parts = from_diagnoser(&bench.diagnoser, &about());
    let refused =
        |parts: &[StatePart]| to_diagnoser(&parts.iter().collect::<Vec<_>>()).unwrap_err();
    assert_eq!(refused(&[]), "it has no part");
    let mut other = parts.clone();
    other[0].software = "0.0.1".to_owned();
    assert_eq!(refused(&other), "it is of version 0.0.1 of the software");
    let mut changed = parts.clone();
    changed[0].text.replace_range(100..101, "/");
    assert_eq!(refused(&changed), "it was changed");
    let mut cut = parts;
    cut[0].parts += 1;
    assert!(refused(&cut).ends_with("parts are there"));
}
