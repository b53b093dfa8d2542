//! Acknowledging and resetting: what an operator may do, and when the evidence speaks against it.

use crate::fixture::{Bench, HOLD, INTERVAL, WARM_UP};
use diagnosis::{
    Action, Event, GivenOrder, GivenOrderKind, OrderRefusal, OrderToken, QuestionToken, Rule,
    StateQuestion, Verdict,
};
use vocabulary::ModulePhase;
use vocabulary::{RunId, Step};

const BIAS_M: f64 = 50e-6;
const RESET: GivenOrderKind = GivenOrderKind::Reset { force: false };
const FORCED: GivenOrderKind = GivenOrderKind::Reset { force: true };

/// A bias in gage g1, latched.
fn faulty() -> Bench {
    let mut bench = Bench::alone(Rule::FirstChange);
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(HOLD + 1);
    assert_eq!(bench.latched(), ["sensor/g1"]);
    bench
}

fn give(bench: &mut Bench, kind: GivenOrderKind) -> Result<u64, OrderRefusal> {
    give_to(bench, "sensor/g1", kind)
}

fn give_to(bench: &mut Bench, component: &str, kind: GivenOrderKind) -> Result<u64, OrderRefusal> {
    let order = GivenOrder {
        kind,
        by: "ada".into(),
        on_behalf_of: None,
        note: Some("looked at it".into()),
    };
    let component = component.parse().unwrap();
    bench.give(Event::Ordered { token: OrderToken(7), component, order });
    match bench.actions.last().unwrap() {
        Action::Obeyed { token: OrderToken(7), sequence } => Ok(*sequence),
        Action::OrderRefused { token: OrderToken(7), refusal } => Err(refusal.clone()),
        other => panic!("{other:?}"),
    }
}

/// Repaired, and the interval has passed.
fn repaired() -> Bench {
    let mut bench = faulty();
    bench.run(500);
    bench.signals.gage_offsets[0] = 0.0;
    bench.run(INTERVAL as u64 + 3000);
    bench
}

#[test]
fn a_fault_is_acknowledged_by_somebody_and_once() {
    let mut bench = faulty();
    let sequence = give(&mut bench, GivenOrderKind::Acknowledge).unwrap();
    let transition = bench.transitions().pop().unwrap().clone();
    assert_eq!((transition.sequence, transition.verdict), (sequence, Verdict::Acknowledged));
    assert_eq!(transition.order.unwrap().by, "ada");
    let again = give(&mut bench, GivenOrderKind::Acknowledge);
    assert!(matches!(again, Err(OrderRefusal::NothingToAcknowledge { state: "acknowledged", .. })));
    bench.run(1000);
    assert_eq!(bench.story("sensor/g1").last(), Some(&"acknowledged"), "it stays");
}

#[test]
fn what_is_not_faulty_can_neither_be_acknowledged_nor_reset() {
    let mut bench = Bench::alone(Rule::FirstChange);
    let refusals = [give(&mut bench, GivenOrderKind::Acknowledge), give(&mut bench, FORCED)];
    assert!(matches!(
        refusals,
        [
            Err(OrderRefusal::NothingToAcknowledge { state: "normal", .. }),
            Err(OrderRefusal::NothingToReset { state: "normal", .. })
        ]
    ));
    let unknown = give_to(&mut bench, "sensor/g99", FORCED);
    assert_eq!(unknown, Err(OrderRefusal::Unknown("sensor/g99".parse().unwrap())));
}

#[test]
fn a_reset_wants_the_fault_acknowledged_and_its_evidence_gone() {
    let mut bench = faulty();
    assert!(matches!(give(&mut bench, RESET), Err(OrderRefusal::NotAcknowledged(_))));
    give(&mut bench, GivenOrderKind::Acknowledge).unwrap();
    assert!(matches!(give(&mut bench, RESET), Err(OrderRefusal::StillChanging { .. })));
    bench.run(60);
    assert!(matches!(give(&mut bench, RESET), Err(OrderRefusal::StillInInterval { .. })));
    bench.run(INTERVAL as u64 + 3000);
    let Err(OrderRefusal::StillDisplaced { now, found, .. }) = give(&mut bench, RESET) else {
        panic!("the bias is still there")
    };
    assert!((now - BIAS_M).abs() < 0.1 * BIAS_M && (found - BIAS_M).abs() < 0.2 * BIAS_M);
    assert_eq!(bench.story("sensor/g1").last(), Some(&"acknowledged"), "refusals change nothing");
}

#[test]
fn after_a_repair_a_reset_is_accepted_and_a_new_fault_is_found_again() {
    let mut bench = repaired();
    give(&mut bench, GivenOrderKind::Acknowledge).unwrap();
    give(&mut bench, RESET).unwrap();
    assert_eq!(bench.story("sensor/g1").last(), Some(&"normal"));
    assert_eq!(bench.diagnoser.phase(), ModulePhase::InService, "never out of service");
    bench.run(2000);
    assert_eq!(bench.latched(), [""; 0], "the repair does not come back as a fault");
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(HOLD + 1);
    assert_eq!(bench.latched(), ["sensor/g1"]);
}

#[test]
fn a_forced_reset_restarts_the_channel() {
    let mut bench = faulty();
    give(&mut bench, FORCED).unwrap();
    assert_eq!(bench.story("sensor/g1").last(), Some(&"normal"));
    bench.run(1);
    assert_eq!(bench.diagnoser.phase(), ModulePhase::Initialising);
    bench.run(WARM_UP + 1000);
    assert_eq!(bench.diagnoser.phase(), ModulePhase::InService);
    assert_eq!(bench.latched(), [""; 0], "what the operator takes for normal is normal");
}

#[test]
fn nothing_can_be_reset_unseen_after_a_restart() {
    let mut bench = faulty();
    give(&mut bench, GivenOrderKind::Acknowledge).unwrap();
    let mut restarted = bench.restarted();
    assert_eq!(restarted.acknowledged(), ["sensor/g1"]);
    assert!(matches!(give(&mut restarted, RESET), Err(OrderRefusal::NotWatched(_))));
    give(&mut restarted, FORCED).unwrap();
    assert_eq!(restarted.acknowledged(), [""; 0]);
}

#[test]
fn a_command_on_a_fault_of_another_run_leaves_the_transition_the_steps_of_that_run() {
    for restart in [false, true] {
        let mut bench = faulty();
        let found = bench.transitions().pop().unwrap().clone();
        if restart {
            bench = bench.restarted();
        } else {
            bench.signals.run = RunId(9);
            bench.signals.step = Step(0);
            bench.run(10);
        }
        give(&mut bench, GivenOrderKind::Acknowledge).unwrap();
        let acknowledged = bench.transitions().pop().unwrap().clone();
        assert_eq!((acknowledged.run, acknowledged.decided), (found.run, found.decided));
    }
}

#[test]
fn acknowledging_and_shelving_leave_a_fault_the_step_as_of_which_it_was_found() {
    let mut bench = faulty();
    let found = bench.transitions().pop().unwrap().decided;
    let until_unix_ns = 7_200_000_000_000;
    let span = vocabulary::Span { since_unix_ns: 1, until_unix_ns };
    for kind in [GivenOrderKind::Acknowledge, GivenOrderKind::Shelve(span)] {
        bench.run(10);
        give(&mut bench, kind).unwrap();
        assert_eq!(bench.transitions().pop().unwrap().decided, found);
    }
    bench.run(10);
    give(&mut bench, FORCED).unwrap();
    let reset = bench.transitions().pop().unwrap();
    assert!(reset.verdict == Verdict::Normal && reset.decided > found, "{reset:?}");
}

/// A fault of actuator a1, found by the rule of the paper, and as of which step.
fn faulty_actuator() -> (Bench, Step) {
    let mut bench = Bench::alone(Rule::Paper);
    bench.signals.pressure_offsets[0] = 2e6;
    bench.run(HOLD + 1);
    assert_eq!(bench.latched(), ["actuator/a1"]);
    let found = bench.transitions().iter().find(|t| t.verdict.is_latched()).unwrap().decided;
    (bench, found)
}

/// The steps of the changes of actuators that a peer receives as of a step.
fn reported(bench: &mut Bench, as_of: Step) -> Vec<Step> {
    let question = StateQuestion { run: bench.signals.run, from: Step(0), as_of, window: None };
    bench.give(Event::Asked { token: QuestionToken(1), question });
    let Action::Answer { answer, .. } = bench.actions.pop().unwrap() else { panic!() };
    answer.actuator_faults.iter().map(|fault| fault.step).collect()
}

#[test]
fn an_acknowledgement_changes_nothing_in_what_peers_receive() {
    let (mut bench, found) = faulty_actuator();
    let before = reported(&mut bench, found);
    assert_eq!(before.len(), 1);
    bench.run(500);
    give_to(&mut bench, "actuator/a1", GivenOrderKind::Acknowledge).unwrap();
    assert_eq!(reported(&mut bench, found), before);
}

#[test]
fn a_fault_of_an_earlier_run_is_there_from_the_first_step_of_the_next_one() {
    for acknowledge in [false, true] {
        let (mut bench, _) = faulty_actuator();
        if acknowledge {
            give_to(&mut bench, "actuator/a1", GivenOrderKind::Acknowledge).unwrap();
        }
        bench.signals.run = RunId(9);
        bench.signals.step = Step(0);
        bench.run(1);
        assert_eq!(reported(&mut bench, Step(0)), [Step(0)]);
    }
}
