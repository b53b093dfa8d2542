//! The diagnoser as a whole: events in, actions out.

use crate::fixture::{Bench, EFFECTS, HOLD, INTERVAL, WARM_UP, name, setup, unchanged_since};
use diagnosis::{
    Action, ActuatorFault, Alarm, Change, Doubt, Event, PeerFailure, QuestionToken, Refusal, Rule,
    SampleRejection, StateAnswer, StateQuestion, Verdict,
};
use vocabulary::ModulePhase;
use vocabulary::{RunId, Step};

const BIAS_M: f64 = 50e-6;
/// Enough to change a gage's channel, too little to reach the root ratio.
const SMALL_BIAS_M: f64 = 14e-6;
const ROOT_M: f64 = 500e-6;

fn answer(question: StateQuestion, changes: Vec<Change>) -> Event {
    // It raises the alarm for what has changed.
    let alarm = |change: &Change| Alarm {
        component: change.component.clone(),
        step: change.step.min(question.as_of),
        faulty: false,
    };
    let alarms = changes.iter().map(alarm).collect();
    let answer = StateAnswer { changes, alarms, ..unchanged_since(Step(WARM_UP), question) };
    Event::Answered(answer)
}

fn change(component: &str, step: Step, ratio: f64) -> Change {
    let component = component.parse().unwrap();
    Change { component, onset: step, step, ratio, until: Some(step) }
}

/// A bias in gage g1, held for as long as the judgement takes; returns the question asked.
fn biased() -> (Bench, StateQuestion) {
    let mut bench = Bench::in_service("lower", Rule::FirstChange);
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(HOLD + 1);
    let questions = bench.questions();
    assert_eq!(questions.len(), 1, "one question for one change");
    (bench, questions[0].1)
}

/// Goes on, every question being answered at once with no change.
fn run_with_a_quiet_peer(bench: &mut Bench, steps: u64) {
    let mut answered = bench.questions().len();
    for _ in 0..steps {
        bench.run(1);
        for (_, question) in bench.questions().split_off(answered) {
            bench.give(answer(question, Vec::new()));
            answered += 1;
        }
    }
}

#[test]
fn nothing_happens_while_nothing_is_wrong() {
    let mut bench = Bench::in_service("lower", Rule::FirstChange);
    bench.run(3000);
    assert_eq!(bench.actions, []);
    assert_eq!(bench.diagnoser.phase(), ModulePhase::InService);
}

#[test]
fn no_verdict_is_given_before_the_warm_up_is_over() {
    let mut bench = Bench::new("lower", Rule::FirstChange);
    bench.run(WARM_UP / 2);
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(WARM_UP / 4);
    assert_eq!(bench.transitions().len(), 0);
    assert_eq!(bench.diagnoser.phase(), ModulePhase::Initialising);
}

#[test]
fn a_sensor_fault_is_latched_once_the_peer_has_nothing_to_explain_it() {
    let (mut bench, question) = biased();
    assert_eq!(bench.story("sensor/g1"), ["tentative"]);
    let injected = question.as_of.minus(HOLD);
    bench.give(answer(question, Vec::new()));
    assert_eq!(bench.story("sensor/g1"), ["tentative", "latched"]);
    let transition = bench.transitions()[1].clone();
    assert_eq!((transition.onset, transition.detection), (injected, injected));
    assert_eq!(transition.decided, question.as_of);
    assert!(transition.evidence.ratio() >= 1.0);
    bench.run(1000);
    assert_eq!(bench.latched(), ["sensor/g1"]);
    assert_eq!(bench.story("sensor/g1").len(), 2, "latched once, permanently");
}

#[test]
fn an_earlier_change_of_a_peer_explains_a_sensor_until_it_is_quiet_again() {
    let (mut bench, question) = biased();
    let earlier = change("actuator/a1", question.as_of.minus(HOLD + 20), 3.0);
    bench.give(answer(question, vec![earlier]));
    let explained = &bench.transitions()[1].verdict;
    let Verdict::Explained { by, .. } = explained else { panic!("{explained:?}") };
    assert_eq!(by.to_string(), "upper/actuator/a1");
    bench.run(100);
    assert_eq!(bench.story("sensor/g1"), ["tentative", "explained", "normal"]);
}

#[test]
fn a_later_change_of_a_peer_explains_nothing() {
    let (mut bench, question) = biased();
    let later = change("actuator/a1", question.as_of.minus(HOLD).plus(4), 300.0);
    bench.give(answer(question, vec![later]));
    assert_eq!(bench.latched(), ["sensor/g1"]);
}

#[test]
fn of_two_simultaneous_changes_the_stronger_one_is_blamed() {
    for (ratio, latched) in [(1.0, vec!["sensor/g1"]), (1e9, vec![])] {
        let (mut bench, question) = biased();
        let rival = change("sensor/g3", question.as_of.minus(HOLD).plus(2), ratio);
        bench.give(answer(question, vec![rival]));
        assert_eq!(bench.latched(), latched);
    }
}

#[test]
fn a_silent_peer_leaves_the_change_unconfirmed_until_it_answers() {
    let (mut bench, question) = biased();
    let failure = PeerFailure::TimedOut;
    bench.give(Event::Unanswered { peer: name("upper"), question, failure });
    assert_eq!(bench.story("sensor/g1"), ["tentative", "unconfirmed"]);
    let unconfirmed = &bench.transitions()[1].verdict;
    assert_eq!(*unconfirmed, Verdict::Unconfirmed { doubt: Doubt::Silent(vec![name("upper")]) });
    bench.run(150);
    assert_eq!(bench.story("sensor/g1").len(), 2, "reported once");
    bench.run(90);
    assert_eq!(bench.questions().len(), 1, "not asked again at once");
    bench.run(20);
    assert_eq!(bench.questions().len(), 2, "but after a while");
    assert_eq!(bench.latched(), [""; 0]);
    let again = bench.questions()[1].1;
    bench.give(answer(again, Vec::new()));
    let latched = bench.transitions().into_iter().find(|t| t.verdict.is_latched()).unwrap();
    assert_eq!(latched.decided, question.as_of, "as if it had answered at once");
    assert_eq!(latched.detection, question.as_of.minus(HOLD));
}

#[test]
fn as_long_as_a_change_is_open_a_later_one_takes_nothing_of_its_evidence() {
    let (mut bench, question) = biased();
    let failure = PeerFailure::TimedOut;
    bench.give(Event::Unanswered { peer: name("upper"), question, failure });
    // The bias leaves the interval, which is a change of its own.
    bench.run(INTERVAL as u64 + 30);
    let changes = bench.actions.iter().filter(|action| matches!(action, Action::Report { .. }));
    assert!(changes.count() >= 2, "there is a second change");
    assert_eq!(bench.story("sensor/g1"), ["tentative", "unconfirmed"]);
    let detections = bench.transitions().into_iter().map(|transition| transition.detection);
    assert!(detections.into_iter().all(|step| step == question.as_of.minus(HOLD)));
}

#[test]
fn too_many_open_changes_are_counted_and_the_first_is_kept() {
    let mut setup = setup("lower", Rule::FirstChange);
    setup.isolation.root_ratio = f64::INFINITY;
    let mut bench = Bench::of(setup);
    bench.run(WARM_UP + 100);
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(HOLD + 1);
    let question = bench.questions()[0].1;
    let failure = PeerFailure::TimedOut;
    bench.give(Event::Unanswered { peer: name("upper"), question, failure });
    // Each larger than the one before, which the channel has got used to.
    for _ in 0..12 {
        bench.signals.gage_offsets[0] *= -2.0;
        bench.run(60);
    }
    assert!(bench.diagnoser.counters().changes_unjudged > 0);
    let again = bench.questions()[1].1;
    bench.give(answer(again, Vec::new()));
    let latched = bench.transitions().into_iter().find(|t| t.verdict.is_latched()).unwrap();
    assert_eq!(latched.detection, question.as_of.minus(HOLD));
}

/// Nobody's fault has an effect of that size, so nobody has to be asked.
#[test]
fn a_jump_is_latched_though_a_peer_is_silent_or_was_not_watching() {
    let ignorant = |question: StateQuestion| {
        let answer = unchanged_since(question.as_of, question);
        Event::Answered(answer)
    };
    let refusing = |question| {
        let failure = PeerFailure::Refused("not now".into());
        Event::Unanswered { peer: name("upper"), question, failure }
    };
    let replies: [&dyn Fn(StateQuestion) -> Event; 2] = [&ignorant, &refusing];
    for reply in replies {
        let mut bench = Bench::in_service("lower", Rule::FirstChange);
        bench.signals.gage_offsets[0] = 10.0 * BIAS_M;
        bench.run(HOLD + 1);
        let question = bench.questions()[0].1;
        assert_eq!(bench.latched(), [""; 0], "an answer may still come");
        bench.give(reply(question));
        assert_eq!(bench.story("sensor/g1"), ["tentative", "latched"]);
        assert_eq!(bench.transitions()[1].detection, question.as_of.minus(HOLD));
    }
}

#[test]
fn a_peer_that_was_not_watching_cannot_clear_anybody() {
    let (mut bench, question) = biased();
    let ignorant = unchanged_since(question.as_of, question);
    bench.give(Event::Answered(ignorant));
    assert_eq!(bench.story("sensor/g1"), ["tentative", "unconfirmed"]);
    assert_eq!(bench.latched(), [""; 0]);
}

#[test]
fn changes_of_ones_own_within_the_effect_time_are_explained_by_the_first() {
    let mut bench = Bench::in_service("lower", Rule::FirstChange);
    bench.signals.gage_offsets[0] = BIAS_M;
    run_with_a_quiet_peer(&mut bench, 20);
    bench.signals.gage_offsets[1] = SMALL_BIAS_M;
    run_with_a_quiet_peer(&mut bench, 4 * EFFECTS);
    assert_eq!(bench.latched(), ["sensor/g1"]);
    assert_eq!(bench.story("sensor/g2")[..3], ["tentative", "explained", "normal"]);
    bench.signals.gage_offsets[2] = BIAS_M;
    run_with_a_quiet_peer(&mut bench, 20);
    assert_eq!(bench.latched(), ["sensor/g1", "sensor/g3"], "after it they are judged afresh");
}

#[test]
fn a_second_fault_that_reaches_the_root_ratio_is_named_too_and_explains_what_follows_it() {
    let mut bench = Bench::in_service("lower", Rule::FirstChange);
    bench.signals.gage_offsets[0] = BIAS_M;
    run_with_a_quiet_peer(&mut bench, 20);
    bench.signals.gage_offsets[1] = ROOT_M;
    run_with_a_quiet_peer(&mut bench, 20);
    assert_eq!(bench.latched(), ["sensor/g1", "sensor/g2"]);
    bench.signals.gage_offsets[2] = SMALL_BIAS_M;
    run_with_a_quiet_peer(&mut bench, 20);
    assert_eq!(bench.latched(), ["sensor/g1", "sensor/g2"]);
    let transitions = bench.transitions();
    let by = transitions.iter().find_map(|t| match &t.verdict {
        Verdict::Explained { by, .. } => Some(by.to_string()),
        _ => None,
    });
    assert_eq!(by.as_deref(), Some("lower/sensor/g2"));
}

#[test]
fn by_the_paper_an_actuator_fault_is_found_alone_and_explains_sensors_for_ever() {
    let mut bench = Bench::in_service("lower", Rule::Paper);
    bench.signals.pressure_offsets[0] = 5e5;
    bench.run(3);
    assert_eq!(bench.latched(), ["actuator/a1"]);
    bench.run(2500);
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(HOLD + 1);
    assert_eq!(bench.questions(), [], "its own actuator explains it: no peer is asked");
    assert_eq!(bench.story("sensor/g1").last(), Some(&"explained"));
    assert_eq!(bench.latched(), ["actuator/a1"]);
}

#[test]
fn by_the_paper_a_peers_actuator_fault_explains_a_sensor_and_a_peers_sensor_does_not() {
    for (faulty, latched) in [(true, vec![]), (false, vec!["sensor/g1"])] {
        let mut bench = Bench::in_service("lower", Rule::Paper);
        bench.signals.gage_offsets[0] = BIAS_M;
        bench.run(HOLD + 1);
        let question = bench.questions()[0].1;
        let fault = ActuatorFault { actuator: "a1".parse().unwrap(), step: Step(350) };
        let answer = StateAnswer {
            changes: vec![change("sensor/g1", question.as_of.minus(10), 9.0)],
            actuator_faults: if faulty { vec![fault] } else { Vec::new() },
            ..unchanged_since(Step(WARM_UP), question)
        };
        bench.give(Event::Answered(answer));
        assert_eq!(bench.latched(), latched);
    }
}

#[test]
fn a_question_is_answered_as_of_its_step_and_not_before() {
    let (mut bench, _) = biased();
    let token = QuestionToken(7);
    let question =
        StateQuestion { run: RunId(1), from: Step(0), as_of: bench.now().plus(5), window: None };
    bench.actions.clear();
    bench.give(Event::Asked { token, question });
    bench.run(4);
    assert_eq!(bench.actions, [], "held");
    assert_eq!(bench.diagnoser.waiting_questions(), 1);
    bench.run(1);
    let [Action::Answer { token: answered, answer }] = &bench.actions[..] else {
        panic!("{:?}", bench.actions)
    };
    assert_eq!((*answered, answer.question), (token, question));
    assert_eq!(answer.changes.len(), 1);
    assert_eq!(answer.changes[0].component.to_string(), "sensor/g1");
}

#[test]
fn a_late_question_gets_the_same_answer_as_one_in_time() {
    let (mut bench, _) = biased();
    let at = bench.now().minus(4);
    let ask = |bench: &mut Bench, token| {
        bench.actions.clear();
        let question = StateQuestion { run: RunId(1), from: Step(0), as_of: at, window: None };
        bench.give(Event::Asked { token: QuestionToken(token), question });
        let Action::Answer { answer, .. } = &bench.actions[0] else { panic!() };
        answer.clone()
    };
    let early = ask(&mut bench, 1);
    bench.run(500);
    assert_eq!(ask(&mut bench, 2), early);
}

/// As of a step before that at which it was decided, it was not decided yet, whenever that is asked.
#[test]
fn what_was_judged_later_is_said_to_be_pending_as_of_before() {
    let mut bench = Bench::alone(Rule::FirstChange);
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(HOLD + 500);
    let latched = (*bench.transitions().last().unwrap()).clone();
    assert_eq!(latched.verdict, Verdict::Latched);
    let mut as_of = |as_of: Step| {
        bench.actions.clear();
        let question = StateQuestion { run: RunId(1), from: Step(0), as_of, window: None };
        bench.give(Event::Asked { token: QuestionToken(1), question });
        let Action::Answer { answer, .. } = &bench.actions[0] else { panic!() };
        (answer.pending.clone(), answer.alarms.len())
    };
    assert_eq!(as_of(latched.detection), (vec![latched.component.clone()], 0));
    assert_eq!(as_of(latched.detection.minus(1)), (vec![], 0));
    assert_eq!(as_of(latched.decided.plus(1)), (vec![], 1));
}

#[test]
fn questions_that_cannot_be_answered_are_refused_with_the_reason() {
    let mut bench = Bench::new("lower", Rule::FirstChange);
    let token = QuestionToken(1);
    let question = StateQuestion { run: RunId(1), from: Step(0), as_of: Step(10), window: None };
    bench.give(Event::Asked { token, question });
    assert_eq!(bench.actions.pop(), Some(Action::Refuse { token, refusal: Refusal::NoSample }));
    bench.run(20);
    bench.actions.clear();
    let other = StateQuestion { run: RunId(2), ..question };
    bench.give(Event::Asked { token, question: other });
    let refusal = Refusal::OtherRun { asked: RunId(2), present: RunId(1) };
    assert_eq!(bench.actions.pop(), Some(Action::Refuse { token, refusal }));
    let far = StateQuestion { as_of: Step(u64::MAX), ..question };
    bench.give(Event::Asked { token, question: far });
    assert!(matches!(
        bench.actions.pop(),
        Some(Action::Refuse { refusal: Refusal::TooFarAhead { .. }, .. })
    ));
    assert_eq!(bench.diagnoser.counters().questions_refused, 3);
}

#[test]
fn a_withdrawn_question_is_not_answered() {
    let mut bench = Bench::in_service("lower", Rule::FirstChange);
    let token = QuestionToken(1);
    let question =
        StateQuestion { run: RunId(1), from: Step(0), as_of: bench.now().plus(5), window: None };
    bench.give(Event::Asked { token, question });
    bench.give(Event::Withdrawn { token });
    bench.run(10);
    assert_eq!(bench.actions, []);
}

#[test]
fn a_flood_of_questions_is_bounded() {
    let mut bench = Bench::in_service("lower", Rule::FirstChange);
    let as_of = bench.now().plus(5);
    for token in 0..5000 {
        let question = StateQuestion { run: RunId(1), from: Step(0), as_of, window: None };
        bench.give(Event::Asked { token: QuestionToken(token), question });
    }
    assert!(bench.diagnoser.waiting_questions() <= 1024);
    assert_eq!(bench.actions.len() + bench.diagnoser.waiting_questions(), 5000);
}

#[test]
fn bad_samples_are_rejected_by_name_and_change_nothing() {
    let mut bench = Bench::in_service("lower", Rule::FirstChange);
    let good = bench.signals.clone().sample();
    let mut short = good.clone();
    short.elongations_m.pop();
    let mut repeated = good.clone();
    repeated.step = bench.now();
    let mut backwards = good.clone();
    backwards.step = Step(3);
    let bad = [
        (short, SampleRejection::WrongLength),
        (repeated, SampleRejection::Repeated),
        (backwards, SampleRejection::Late),
    ];
    for (sample, rejection) in bad {
        let step = sample.step;
        bench.give(Event::Sample(sample));
        assert_eq!(bench.actions, [Action::Rejected { step, rejection }]);
        bench.actions.clear();
    }
    let counters = *bench.diagnoser.counters();
    assert_eq!(counters.samples_wrong_length, 1);
    assert_eq!((counters.samples_repeated, counters.samples_late), (1, 1));
    bench.run(1000);
    assert_eq!(bench.actions, [], "no gap, no change: as if they had never come");
}

#[test]
fn one_absurd_step_does_not_blind_the_module_and_a_true_jump_is_followed() {
    let mut bench = Bench::in_service("lower", Rule::FirstChange);
    let mut absurd = bench.signals.clone().sample();
    absurd.step = Step(u64::MAX);
    let step = absurd.step;
    bench.give(Event::Sample(absurd));
    assert_eq!(bench.actions, [Action::Rejected { step, rejection: SampleRejection::FarAhead }]);
    bench.actions.clear();
    bench.run(100);
    assert_eq!(bench.actions, [], "honest samples go on as if nothing had been");
    bench.signals.step = bench.signals.step.plus(50_000);
    bench.run(2);
    assert_eq!(bench.now(), bench.signals.step.minus(1));
    assert_eq!(bench.diagnoser.counters().samples_far_ahead, 2);
    assert_eq!(bench.diagnoser.counters().samples_missing, 50_001);
}

#[test]
fn a_gap_is_counted_and_causes_no_change() {
    let mut bench = Bench::in_service("lower", Rule::FirstChange);
    let from = bench.now().plus(1);
    bench.signals.step = bench.signals.step.plus(4);
    bench.run(2000);
    let since = from.plus(4 + 4);
    let expected = [
        Action::Gap { from, missing: 4 },
        Action::Phase { phase: ModulePhase::Initialising, in_service_since: None },
        Action::Phase { phase: ModulePhase::InService, in_service_since: Some(since) },
    ];
    assert_eq!(bench.actions, expected, "blind until there is a whole vector again");
    assert_eq!(bench.diagnoser.counters().samples_missing, 4);
}

#[test]
fn as_many_lost_samples_as_a_tie_has_blind_nobody() {
    for missing in 1..=3 {
        let mut bench = Bench::in_service("lower", Rule::FirstChange);
        let from = bench.now().plus(1);
        bench.signals.step = bench.signals.step.plus(missing);
        bench.run(2000);
        assert_eq!(bench.actions, [Action::Gap { from, missing }]);
    }
}

#[test]
fn what_begins_at_a_lost_sample_is_found_with_the_next_one() {
    let mut bench = Bench::alone(Rule::FirstChange);
    let lost = bench.signals.step;
    bench.signals.step = lost.plus(1);
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(HOLD + 2);
    let found = bench.transitions()[0].clone();
    assert_eq!(
        (found.component.to_string().as_str(), found.detection),
        ("sensor/g1", lost.plus(1))
    );
    assert_eq!(bench.latched(), ["sensor/g1"]);
}

#[test]
fn a_new_run_starts_afresh_but_keeps_what_is_latched() {
    let (mut bench, question) = biased();
    bench.give(answer(question, Vec::new()));
    bench.signals.run = RunId(2);
    bench.signals.step = Step(0);
    bench.run(10);
    assert_eq!(bench.diagnoser.phase(), ModulePhase::Initialising);
    assert_eq!(bench.latched(), ["sensor/g1"]);
    assert_eq!(bench.diagnoser.counters().runs, 2);
    bench.run(WARM_UP);
    assert_eq!(bench.diagnoser.phase(), ModulePhase::InService);
}

#[test]
fn a_publisher_that_begins_again_with_the_same_run_begins_a_run() {
    let mut bench = Bench::in_service("lower", Rule::FirstChange);
    bench.signals.step = Step(0);
    bench.run(49);
    assert_eq!(bench.diagnoser.counters().samples_late, 49);
    assert_eq!(bench.diagnoser.phase(), ModulePhase::InService, "these may be late ones");
    bench.run(1);
    assert_eq!(bench.diagnoser.phase(), ModulePhase::Initialising);
    assert_eq!(bench.now(), Step(49));
    bench.run(WARM_UP + 10);
    assert_eq!(bench.diagnoser.phase(), ModulePhase::InService);
    let counters = bench.diagnoser.counters();
    assert_eq!((counters.runs, counters.samples_late), (2, 49));
}

#[test]
fn late_samples_among_those_of_the_run_begin_nothing() {
    let mut bench = Bench::in_service("lower", Rule::FirstChange);
    let mut late = bench.signals.clone();
    late.step = Step(0);
    for _ in 0..100 {
        bench.give(Event::Sample(late.sample()));
        bench.run(1);
    }
    assert_eq!(
        (bench.diagnoser.counters().runs, bench.diagnoser.counters().samples_late),
        (1, 100)
    );
}

#[test]
fn answers_that_do_not_fit_are_counted_and_ignored() {
    let lies = |question: StateQuestion| {
        let honest = unchanged_since(Step(WARM_UP), question);
        let with = |changes| StateAnswer { changes, ..honest.clone() };
        let fault = |step| ActuatorFault { actuator: "a1".parse().unwrap(), step };
        vec![
            with(vec![change("actuator/a1", question.as_of.plus(1), 5.0)]),
            with(vec![change("actuator/a1", question.as_of, f64::NAN)]),
            with(vec![change("actuator/a1", question.as_of, 0.5)]),
            with(vec![change("actuator/a1", question.as_of, 5.0); 5000]),
            StateAnswer { actuator_faults: vec![fault(question.as_of.plus(1))], ..honest.clone() },
        ]
    };
    for lie in 0..5 {
        let (mut bench, question) = biased();
        let answer = lies(question).swap_remove(lie);
        bench.give(Event::Answered(answer));
        assert_eq!(bench.diagnoser.counters().answers_malformed, 1);
        assert_eq!(bench.story("sensor/g1"), ["tentative", "unconfirmed"]);
    }
    let (mut bench, question) = biased();
    let answer = StateAnswer { module: name("impostor"), ..unchanged_since(Step(0), question) };
    bench.give(Event::Answered(answer));
    assert_eq!(bench.diagnoser.counters().answers_malformed, 1);
    assert_eq!(bench.story("sensor/g1"), ["tentative"]);
}

/// The peer did nothing wrong: the run changed before its answer arrived. Its next answer must still count.
#[test]
fn a_late_answer_of_a_former_run_is_ignored() {
    let (mut bench, former) = biased();
    bench.signals.gage_offsets[0] = 0.0;
    (bench.signals.run, bench.signals.step) = (RunId(2), Step(0));
    bench.run(WARM_UP + 100);
    bench.give(answer(former, Vec::new()));
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(HOLD + 1);
    let question = bench.questions().pop().unwrap().1;
    assert_eq!(question.run, RunId(2));
    bench.give(answer(former, Vec::new()));
    bench.give(answer(StateQuestion { as_of: question.as_of.minus(1), ..question }, Vec::new()));
    assert_eq!(bench.story("sensor/g1"), ["tentative", "unconfirmed"]);
    bench.give(answer(question, Vec::new()));
    assert_eq!(bench.story("sensor/g1"), ["tentative", "unconfirmed", "latched"]);
    assert_eq!(bench.diagnoser.counters().answers_malformed, 0);
}

#[test]
fn several_changes_are_put_into_one_question() {
    let mut bench = Bench::in_service("lower", Rule::FirstChange);
    bench.signals.gage_offsets = vec![BIAS_M; 3];
    bench.run(HOLD + 1);
    assert_eq!(bench.questions().len(), 1);
    bench.give(answer(bench.questions()[0].1, Vec::new()));
    assert_eq!(bench.latched().len(), 1, "one is blamed, the others are explained");
}

#[test]
fn sequence_numbers_are_contiguous() {
    let (mut bench, question) = biased();
    bench.give(answer(question, Vec::new()));
    bench.signals.gage_offsets[1] = BIAS_M;
    bench.run(HOLD + 1);
    bench.give(answer(bench.questions()[1].1, Vec::new()));
    bench.run(200);
    let sequences: Vec<u64> = bench.transitions().iter().map(|t| t.sequence).collect();
    let expected: Vec<u64> = (1..=sequences.len() as u64).collect();
    assert_eq!(sequences, expected);
    assert_eq!(bench.diagnoser.next_sequence(), expected.len() as u64 + 1);
}

#[test]
fn the_same_events_lead_to_the_same_actions() {
    let run = || {
        let (mut bench, question) = biased();
        bench.give(answer(question, Vec::new()));
        bench.run(500);
        bench.actions
    };
    assert_eq!(run(), run());
}

#[test]
fn everything_wrong_with_a_setup_is_reported_at_once() {
    let mut bad = setup("lower", Rule::FirstChange);
    bad.detection.divergence.window = 0;
    bad.hydraulics.as_mut().unwrap().volume_a_m3 = -1.0;
    bad.isolation.hold_steps = 1;
    bad.thresholds[1] = f64::NAN;
    bad.peers.push(name("lower"));
    let problems = diagnosis::Diagnoser::new(bad).unwrap_err();
    let text: Vec<String> = problems.iter().map(ToString::to_string).collect();
    let text = text.join("\n");
    for named in ["window is 0", "volume_a_m3", "hold_ms", "threshold of a2", "peer `lower`"] {
        assert!(text.contains(named), "{named} is missing in:\n{text}");
    }
}
