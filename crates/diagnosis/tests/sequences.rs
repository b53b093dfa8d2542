//! What holds of a diagnoser whatever happens to it, restarts and operators included.

use crate::sequence::{Driver, Happening, Said, happening, is_of_alarm, shelving, unshelved};
use diagnosis::{Action, Rule, Verdict};
use proptest::prelude::*;

/// Drives a diagnoser through everything; each event is held against the invariants.
fn drive(rule: Rule, root_ratio: f64, peers: &[&str], happenings: &[Happening]) -> Driver {
    let mut driver = Driver::in_service(rule, root_ratio, peers);
    happenings.iter().for_each(|happening| driver.apply(happening));
    driver
}

fn rule() -> impl Strategy<Value = Rule> {
    prop_oneof![3 => Just(Rule::FirstChange), 2 => Just(Rule::Paper)]
}

fn root_ratio() -> impl Strategy<Value = f64> {
    prop_oneof![Just(15.0), Just(f64::INFINITY)]
}

fn peers() -> impl Strategy<Value = &'static [&'static str]> {
    prop_oneof![
        1 => Just(&[][..]),
        3 => Just(&["upper"][..]),
        3 => Just(&["upper", "annex"][..]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..Default::default() })]

    #[test]
    fn invariants_hold_for_any_sequence_of_events(
        rule in rule(),
        root_ratio in root_ratio(),
        peers in peers(),
        happenings in prop::collection::vec(happening(), 1..80),
    ) {
        let driver = drive(rule, root_ratio, peers, &happenings);
        let again = drive(rule, root_ratio, peers, &happenings);
        prop_assert_eq!(&driver.history, &again.history, "same events, same actions");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..Default::default() })]

    /// Whatever is set aside and whenever, the diagnosis goes on as if it were not.
    #[test]
    fn no_verdict_question_or_answer_depends_on_what_is_set_aside(
        rule in rule(),
        root_ratio in root_ratio(),
        peers in peers(),
        happenings in prop::collection::vec(
            prop_oneof![3 => happening(), 2 => shelving()],
            1..100,
        ),
    ) {
        let plain: Vec<Happening> =
            happenings.iter().filter(|one| !is_shelving(one)).cloned().collect();
        let with = drive(rule, root_ratio, peers, &happenings);
        let without = drive(rule, root_ratio, peers, &plain);
        let (with, without) = (unshelved(&with.history), unshelved(&without.history));
        prop_assert_eq!(with.len(), without.len());
        let other = with.iter().zip(&without).find(|(one, other)| one != other);
        prop_assert!(other.is_none(), "{:?}", other);
    }
}

fn is_shelving(happening: &Happening) -> bool {
    matches!(happening, Happening::Ordered { kind, .. } if is_of_alarm(*kind))
}

/// Found at random: after a restart a change that was seen before it shows a step earlier.
#[test]
fn a_change_that_shows_earlier_after_a_restart_is_the_same_change() {
    use Happening::{Answered, Fault, Gap, Restart, Samples};
    let said = |changes: &[(f64, f64)]| Said {
        peer: 0,
        fits: false,
        watching_since: Some(0),
        changes: changes.to_vec(),
        actuator_faults: Vec::new(),
    };
    let happenings = [
        Fault { gage: 0, offset_m: -5.748004649999599e-5 },
        Samples(91),
        Answered(said(&[(0.0, 174.88097270878984)])),
        Samples(22),
        Gap(4),
        Samples(17),
        Restart { missed: 21, again: 0 },
        Samples(49),
        Restart { missed: 0, again: 284 },
        Samples(79),
        Restart { missed: 2, again: 364 },
        Samples(3),
        Answered(said(&[])),
    ];
    let driver = drive(Rule::FirstChange, 15.0, &["upper"], &happenings);
    let mut verdicts = driver.history.iter().filter_map(|action| match action {
        Action::Publish(transition) => Some((transition.detection.0, &transition.verdict)),
        _ => None,
    });
    assert_eq!(verdicts.next_back(), Some((681, &Verdict::Latched)));
}
