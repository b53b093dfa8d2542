//! Shelved and suppressed alarms, cylinders that are shut off, and declared faults: who ordered it, how long it lasts, and
//! how it ends.

use crate::fixture::{Bench, HOLD};
use diagnosis::{
    Action, Event, GivenOrder, GivenOrderKind, OrderRefusal, OrderToken, Rule, Span, Transition,
    Verdict,
};
use proptest::prelude::*;
use vocabulary::{RunId, Step};

const BIAS_M: f64 = 50e-6;
const CYLINDER: &str = "actuator/a1";
const SPAN: Span = Span { since_unix_ns: 1_000, until_unix_ns: 5_000 };
const LATER: Span = Span { since_unix_ns: 2_000, until_unix_ns: 9_000 };

fn give(bench: &mut Bench, kind: GivenOrderKind) -> Result<Transition, OrderRefusal> {
    give_to(bench, "sensor/g1", kind)
}

fn give_to(
    bench: &mut Bench,
    component: &str,
    kind: GivenOrderKind,
) -> Result<Transition, OrderRefusal> {
    let order = GivenOrder {
        kind,
        by: "web".into(),
        on_behalf_of: Some("ada".into()),
        note: Some("painting".into()),
    };
    let (token, component) = (OrderToken(7), component.parse().unwrap());
    bench.give(Event::Ordered { token, component, order: order.clone() });
    match &bench.actions[bench.actions.len().saturating_sub(2)..] {
        [.., Action::OrderRefused { refusal, .. }] => Err(refusal.clone()),
        [Action::Publish(transition), Action::Obeyed { sequence, .. }] => {
            assert_eq!((transition.sequence, &transition.order), (*sequence, &Some(order)));
            Ok(transition.clone())
        }
        other => panic!("{other:?}"),
    }
}

/// Until when it is shelved, until when suppressed.
fn ends(transition: &Transition) -> (Option<u64>, Option<u64>) {
    let end = |aside: &Option<Box<diagnosis::Shelving>>| Some(aside.as_ref()?.until_unix_ns);
    (end(&transition.shelved), end(&transition.suppressed))
}

fn latched() -> Bench {
    let mut bench = Bench::alone(Rule::FirstChange);
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(HOLD + 1);
    bench
}

#[test]
fn a_shelved_fault_stays_latched_and_says_by_whom_why_and_until_when() {
    let mut bench = latched();
    let before = bench.transitions().pop().unwrap().clone();
    bench.run(30);
    let shelved = give(&mut bench, GivenOrderKind::Shelve(SPAN)).unwrap();
    let (order, by_whom) = (shelved.order.clone(), shelved.shelved.clone().unwrap());
    assert_eq!(
        (by_whom.span(), by_whom.by.as_str(), by_whom.reason.as_str()),
        (SPAN, "web", "painting")
    );
    assert_eq!(by_whom.on_behalf_of.as_deref(), Some("ada"));
    let sequence = before.sequence + 1;
    let expected = Transition { sequence, order, shelved: Some(by_whom), ..before };
    assert_eq!(shelved, expected, "the rest is as it was");
}

#[test]
fn what_is_not_set_aside_cannot_be_brought_back() {
    let mut bench = latched();
    let component = || "sensor/g1".parse().unwrap();
    let refusal = give(&mut bench, GivenOrderKind::Unshelve).unwrap_err();
    assert_eq!(refusal, OrderRefusal::NotShelved(component()));
    assert_eq!(refusal.to_string(), "`sensor/g1` is not shelved");
    let refused = give(&mut bench, GivenOrderKind::Unsuppress);
    assert_eq!(refused, Err(OrderRefusal::NotSuppressed(component())));
    let lapse = GivenOrderKind::Lapse { now_unix_ns: 6_000 };
    assert_eq!(give(&mut bench, lapse), Err(OrderRefusal::NothingIsOver(component())));
    give(&mut bench, GivenOrderKind::Shelve(SPAN)).unwrap();
    let refused = give(&mut bench, GivenOrderKind::Unsuppress);
    assert_eq!(refused, Err(OrderRefusal::NotSuppressed(component())), "shelved is not suppressed");
}

#[test]
fn shelving_and_suppression_are_independent_and_the_later_order_replaces_the_earlier() {
    let mut bench = latched();
    let mut step = |kind| ends(&give(&mut bench, kind).unwrap());
    assert_eq!(step(GivenOrderKind::Shelve(LATER)), (Some(9_000), None));
    assert_eq!(step(GivenOrderKind::Shelve(SPAN)), (Some(5_000), None));
    assert_eq!(step(GivenOrderKind::Suppress(LATER)), (Some(5_000), Some(9_000)));
    assert_eq!(step(GivenOrderKind::Unshelve), (None, Some(9_000)));
    assert_eq!(step(GivenOrderKind::Shelve(SPAN)), (Some(5_000), Some(9_000)));
    assert_eq!(step(GivenOrderKind::Lapse { now_unix_ns: 5_000 }), (None, Some(9_000)));
    assert_eq!(step(GivenOrderKind::Lapse { now_unix_ns: 9_000 }), (None, None));
}

#[test]
fn acknowledging_and_resetting_keep_what_is_set_aside_and_are_not_kept_by_it() {
    let mut bench = latched();
    give(&mut bench, GivenOrderKind::Shelve(SPAN)).unwrap();
    let acknowledged = give(&mut bench, GivenOrderKind::Acknowledge).unwrap();
    assert_eq!(acknowledged.verdict, Verdict::Acknowledged);
    let again = give(&mut bench, GivenOrderKind::Shelve(SPAN)).unwrap();
    assert_eq!(again.command(), acknowledged.order.as_ref(), "who acknowledged it stands there");
    let reset = give(&mut bench, GivenOrderKind::Reset { force: true }).unwrap();
    assert_eq!((reset.verdict.clone(), ends(&reset)), (Verdict::Normal, (Some(5_000), None)));
}

#[test]
fn a_component_that_never_changed_is_shelved_even_before_the_first_sample_and_found_faulty_all_the_same()
 {
    let mut bench = Bench::new("lower", Rule::FirstChange);
    let early = give(&mut bench, GivenOrderKind::Shelve(SPAN)).unwrap();
    assert_eq!((early.run, early.decided, early.verdict), (RunId(0), Step(0), Verdict::Normal));
    let mut bench = Bench::alone(Rule::FirstChange);
    let shelved = give(&mut bench, GivenOrderKind::Shelve(SPAN)).unwrap();
    assert_eq!((shelved.run, shelved.decided), (bench.signals.run, bench.now()));
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(HOLD + 1);
    assert_eq!(bench.latched(), ["sensor/g1"]);
    let found = bench.transitions();
    assert!(found.iter().all(|transition| ends(transition) == (Some(5_000), None)), "{found:?}");
}

#[test]
fn it_survives_a_restart() {
    let mut bench = latched();
    give(&mut bench, GivenOrderKind::Shelve(SPAN)).unwrap();
    give(&mut bench, GivenOrderKind::Suppress(LATER)).unwrap();
    let mut again = bench.restarted();
    let lapse = GivenOrderKind::Lapse { now_unix_ns: 5_000 };
    let lapsed = give(&mut again, lapse).unwrap();
    assert_eq!((ends(&lapsed), lapsed.verdict), ((None, Some(9_000)), Verdict::Latched));
}

#[test]
fn only_a_cylinder_whose_fault_is_latched_is_shut_off_and_it_is_put_back_before_its_reset() {
    let order = GivenOrderKind::ShutOff { since_unix_ns: 5 };
    let mut bench = latched();
    let refusal = give(&mut bench, order).unwrap_err();
    assert_eq!(refusal, OrderRefusal::NotACylinder("sensor/g1".parse().unwrap()));
    let mut bench = Bench::alone(Rule::FirstChange);
    let refusal = give_to(&mut bench, CYLINDER, order).unwrap_err();
    assert!(matches!(refusal, OrderRefusal::NothingToShutOff { state: "normal", .. }), "{refusal}");
    bench.signals.pressure_offsets[0] = 1e6;
    bench.run(HOLD + 1);
    assert_eq!(bench.latched(), [CYLINDER]);
    let refusal = give_to(&mut bench, CYLINDER, GivenOrderKind::PutBack).unwrap_err();
    assert_eq!(refusal.to_string(), "`actuator/a1` is not shut off");
    let shut_off = give_to(&mut bench, CYLINDER, order).unwrap();
    assert_eq!(
        (&shut_off.verdict, &shut_off.order),
        (&Verdict::Latched, &shut_off.shut_off.clone().map(|by| *by))
    );
    let acknowledged = give_to(&mut bench, CYLINDER, GivenOrderKind::Acknowledge).unwrap();
    assert_eq!(acknowledged.shut_off, shut_off.shut_off, "it stays shut off");
    let mut again = bench.restarted();
    let refusal =
        give_to(&mut again, CYLINDER, GivenOrderKind::Reset { force: false }).unwrap_err();
    assert_eq!(refusal, OrderRefusal::ShutOff(CYLINDER.parse().unwrap()), "after a restart too");
    let put_back = give_to(&mut again, CYLINDER, GivenOrderKind::PutBack).unwrap();
    assert_eq!((put_back.shut_off, put_back.verdict), (None, Verdict::Acknowledged));
}

#[test]
fn what_an_operator_knows_to_be_faulty_is_latched_until_its_reset() {
    let mut bench = Bench::alone(Rule::FirstChange);
    let declared = give(&mut bench, GivenOrderKind::Declare).unwrap();
    assert_eq!((declared.verdict.clone(), declared.detection), (Verdict::Latched, bench.now()));
    let refusal = give(&mut bench, GivenOrderKind::Declare).unwrap_err();
    assert_eq!(refusal.to_string(), "`sensor/g1` is latched already");
    bench.run(HOLD + 1);
    assert_eq!(bench.latched(), ["sensor/g1"], "and nothing else");
    give(&mut bench, GivenOrderKind::Acknowledge).unwrap();
    let reset = give(&mut bench, GivenOrderKind::Reset { force: false }).unwrap();
    assert_eq!(reset.verdict, Verdict::Normal);
}

proptest! {
    /// A minute is nothing, for clocks are adjusted; a clock that was set back must not keep an alarm away.
    #[test]
    fn a_span_is_over_at_its_end_and_long_before_its_beginning(
        since_unix_ns in 0..u64::MAX / 2,
        length in 0..u64::MAX / 4,
        now in any::<u64>(),
    ) {
        let span = Span { since_unix_ns, until_unix_ns: since_unix_ns + length };
        let minute = 60_000_000_000;
        let goes_on = now < since_unix_ns + length && now >= since_unix_ns.saturating_sub(minute);
        prop_assert_eq!(span.is_over(now), !goes_on);
        prop_assert!(span.is_over(span.until_unix_ns));
        prop_assert!(length == 0 || !span.is_over(since_unix_ns));
    }
}

const SECOND: u64 = 1_000_000_000;
const NOW: u64 = 1_800_000_000 * SECOND;

fn seconds(seconds: u64) -> Span {
    Span { since_unix_ns: NOW, until_unix_ns: NOW + seconds * SECOND }
}

/// The components whose shelving or suppression has expired.
fn lapsing(bench: &Bench, now_unix_ns: u64) -> Vec<String> {
    let orders = bench.diagnoser.lapses(now_unix_ns);
    orders.iter().map(|(component, _)| component.to_string()).collect()
}

#[test]
fn what_has_had_its_time_lapses_once_before_the_first_sample_too() {
    let mut bench = Bench::alone(Rule::FirstChange);
    give_to(&mut bench, CYLINDER, GivenOrderKind::Shelve(seconds(10))).unwrap();
    give(&mut bench, GivenOrderKind::Suppress(seconds(20))).unwrap();
    assert_eq!(lapsing(&bench, NOW + 9 * SECOND), [""; 0]);
    assert_eq!(lapsing(&bench, NOW + 10 * SECOND), [CYLINDER]);
    for (component, order) in bench.diagnoser.lapses(NOW + 10 * SECOND) {
        bench.give(Event::Ordered { token: OrderToken(0), component, order });
        assert!(matches!(bench.actions.last(), Some(Action::Obeyed { sequence: 3, .. })));
    }
    assert_eq!(lapsing(&bench, NOW + 10 * SECOND), [""; 0]);
    assert_eq!(lapsing(&bench, NOW + 60 * SECOND), ["sensor/g1"]);
}

#[test]
fn a_clock_that_was_set_back_ends_what_has_not_begun_yet() {
    let mut bench = Bench::alone(Rule::FirstChange);
    give(&mut bench, GivenOrderKind::Shelve(seconds(7200))).unwrap();
    assert_eq!(lapsing(&bench, NOW - 59 * SECOND), [""; 0], "clocks are adjusted");
    assert_eq!(lapsing(&bench, NOW - 61 * SECOND), ["sensor/g1"]);
}

#[test]
fn only_what_is_suppressed_is_named_as_such() {
    let mut bench = Bench::alone(Rule::FirstChange);
    assert_eq!(bench.diagnoser.suppressed().count(), 0);
    give(&mut bench, GivenOrderKind::Suppress(seconds(100))).unwrap();
    give_to(&mut bench, CYLINDER, GivenOrderKind::Suppress(seconds(100))).unwrap();
    give(&mut bench, GivenOrderKind::Unsuppress).unwrap();
    let left: Vec<String> = bench.diagnoser.suppressed().map(ToString::to_string).collect();
    assert_eq!(left, [CYLINDER]);
}
