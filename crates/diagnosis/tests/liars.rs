//! Peers that lie plausibly: what they say fits the question, but they do not stand by it.

use crate::fixture::{Bench, HOLD, WARM_UP, name};
use diagnosis::{
    Action, Alarm, Change, Doubt, Event, PeerFailure, Rule, StateAnswer, StateQuestion, Verdict,
};
use vocabulary::{Component, Step};

/// Shows, but is too small to be a root cause by its ratio as it leaves the interval.
const BIAS_M: f64 = 14e-6;

/// What the peer says of itself.
#[derive(Clone, Default)]
struct Said {
    changes: Vec<Change>,
    alarms: Vec<Alarm>,
    pending: Vec<Component>,
    watching_since: Option<Step>,
}

impl Said {
    /// As of the question's step.
    fn answer(&self, question: StateQuestion) -> Event {
        let asked = |change: &&Change| {
            change.step <= question.as_of && change.until.is_none_or(|until| until >= question.from)
        };
        let changes = self.changes.iter().filter(asked).cloned().collect();
        let watching_since = self.watching_since.or(Some(Step(WARM_UP)));
        let (actuator_faults, alarms) = (Vec::new(), self.alarms.clone());
        let pending = self.pending.clone();
        let (module, window) = (name("upper"), None);
        Event::Answered(StateAnswer {
            module,
            question,
            watching_since,
            changes,
            actuator_faults,
            alarms,
            pending,
            window,
        })
    }
}

/// A bias in gage g1, and a peer that says a cylinder of its own changed one step before. Returns when that was.
fn explained(ratio: f64) -> (Bench, Said, Step) {
    let mut bench = Bench::in_service("lower", Rule::FirstChange);
    bench.signals.gage_offsets[0] = BIAS_M;
    while bench.questions().is_empty() {
        bench.run(1);
    }
    let question = bench.questions()[0].1;
    let step = question.as_of.minus(HOLD + 1);
    let component = "actuator/a1".parse().unwrap();
    let change = Change { component, onset: step, step, ratio, until: Some(step) };
    let said = Said { changes: vec![change], ..Said::default() };
    bench.give(said.answer(question));
    (bench, said, step)
}

/// Goes on while the peer says what it says; returns how often it was asked.
fn go_on(bench: &mut Bench, said: &Said, steps: u64) -> usize {
    let before = bench.questions().len();
    let mut answered = before;
    for _ in 0..steps {
        bench.run(1);
        for (_, question) in bench.questions().split_off(answered) {
            bench.give(said.answer(question));
            answered += 1;
        }
    }
    answered - before
}

#[test]
fn who_raises_no_alarm_explains_nothing() {
    let (mut bench, said, _) = explained(50.0);
    go_on(&mut bench, &said, 1000);
    assert_eq!(bench.verdict("sensor/g1").as_str(), "explained");
    go_on(&mut bench, &said, 6000);
    assert!(!bench.story("sensor/g1").contains(&"normal"), "not on a word alone");
    assert_eq!(bench.latched(), ["sensor/g1"]);
    let latched = (*bench.transitions().last().unwrap()).clone();
    let by = "upper/actuator/a1".parse().unwrap();
    assert_eq!(latched.disputed.as_ref(), Some(&by));
    assert_eq!((latched.onset, latched.detection), {
        let tentative = bench.transitions()[0];
        (tentative.onset, tentative.detection)
    });
    let component = "sensor/g1".parse().unwrap();
    assert!(bench.actions.contains(&Action::WordBroken { component, by }));
    assert_eq!(bench.diagnoser.counters().verdicts_disputed, 1);
}

#[test]
fn who_raises_the_alarm_is_believed() {
    for (faulty, after) in [(true, 0), (false, 0), (true, 1000)] {
        let (mut bench, mut said, step) = explained(50.0);
        go_on(&mut bench, &said, after);
        let component = "actuator/a1".parse().unwrap();
        said.alarms = vec![Alarm { component, step, faulty }];
        go_on(&mut bench, &said, 6000);
        assert_eq!(bench.verdict("sensor/g1"), Verdict::Normal, "{after}");
        assert_eq!(bench.latched(), [""; 0], "{after}");
        assert_eq!(bench.diagnoser.counters().verdicts_disputed, 0);
    }
}

#[test]
fn who_has_not_judged_yet_is_waited_for_but_not_forever() {
    let pending = || vec!["actuator/a1".parse().unwrap()];
    let (mut bench, mut said, step) = explained(50.0);
    said.pending = pending();
    go_on(&mut bench, &said, 8000);
    assert_eq!(bench.verdict("sensor/g1").as_str(), "explained");
    let component = "actuator/a1".parse().unwrap();
    (said.pending, said.alarms) = (Vec::new(), vec![Alarm { component, step, faulty: true }]);
    go_on(&mut bench, &said, 60_000);
    assert_eq!(bench.verdict("sensor/g1"), Verdict::Normal);
    let (mut bench, mut said, _) = explained(50.0);
    said.pending = pending();
    go_on(&mut bench, &said, 120_000);
    assert_eq!(bench.latched(), ["sensor/g1"]);
}

#[test]
fn who_has_forgotten_leaves_it_unconfirmed() {
    let (mut bench, mut said, step) = explained(50.0);
    said.watching_since = Some(step.plus(1));
    go_on(&mut bench, &said, 1000);
    let doubt = Doubt::Unknowing(vec![name("upper")]);
    assert_eq!(bench.verdict("sensor/g1"), Verdict::Unconfirmed { doubt });
}

#[test]
fn as_long_as_the_peer_is_silent_the_verdict_stays_open() {
    let (mut bench, said, _) = explained(50.0);
    bench.run(300);
    let (peer, question) = bench.questions().pop().unwrap();
    bench.give(Event::Unanswered { peer, question, failure: PeerFailure::Absent });
    bench.run(200);
    assert!(!bench.story("sensor/g1").contains(&"normal"));
    go_on(&mut bench, &said, 6000);
    assert_eq!(bench.latched(), ["sensor/g1"]);
}

#[test]
fn a_change_larger_than_any_can_be_is_refused() {
    let (bench, _, _) = explained(1e300);
    assert_eq!(bench.story("sensor/g1"), ["tentative", "unconfirmed"]);
    let (peer, reason) = (name("upper"), "a change larger than any can be".to_owned());
    let rejected = Action::AnswerRejected { peer, failure: PeerFailure::Malformed(reason) };
    assert!(bench.actions.contains(&rejected));
}

#[test]
fn the_past_gets_no_changes_afterwards() {
    let (mut bench, mut said, step) = explained(50.0);
    let component = "sensor/g3".parse().unwrap();
    said.changes.push(Change { component, ..said.changes[0].clone() });
    said.changes[1].until = None;
    go_on(&mut bench, &said, 300);
    assert_eq!(bench.diagnoser.counters().answers_malformed, 1);
    let rejections = bench.actions.iter().filter_map(|action| match action {
        Action::AnswerRejected { failure, .. } => Some(failure.to_string()),
        _ => None,
    });
    let expected = format!(
        "answer malformed: sensor/g3 changed at step {step}, but there was no such change in its answer as of \
        step {}",
        step.plus(HOLD + 1)
    );
    assert_eq!(rejections.collect::<Vec<_>>(), [expected]);
}

#[test]
fn after_a_restart_the_word_is_asked_for_all_the_same() {
    let (bench, said, _) = explained(50.0);
    let until = bench.now();
    let mut again = bench.restarted();
    while again.signals.step <= until {
        again.signals.gage_offsets[0] =
            if again.signals.step.plus(HOLD) >= until { BIAS_M } else { 0.0 };
        again.run(1);
    }
    go_on(&mut again, &said, 6000);
    assert_eq!(again.latched(), ["sensor/g1"]);
    assert!(again.transitions().last().unwrap().disputed.is_some());
}
