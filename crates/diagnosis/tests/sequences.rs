//! What holds of a diagnoser whatever happens to it, restarts and operators included.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "test code")]

mod fixture;
mod sequence;

use diagnosis::Rule;
use proptest::prelude::*;
use sequence::{Driver, Happening, happening};

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
