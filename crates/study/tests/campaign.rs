//! Campaigns on the shipped tower.

use std::collections::BTreeSet;

use crate::tower;
use study::Campaign;
use study::scenarios::{ScenarioCampaign, ScenarioRanges};
use vocabulary::fault::{Fault, FaultKind};

fn campaign(mismatch: f64, seed: u64) -> ScenarioCampaign {
    let ranges = ScenarioRanges { length_s: 5.0, onset_s: [3.5, 4.0], ..ScenarioRanges::default() };
    tower::scenarios(tower::system(mismatch, seed), ranges)
}

#[test]
fn scenarios_follow_from_seed_and_number_alone_and_stay_within_their_ranges() {
    let campaign = campaign(0.0, 42);
    let draw = |number| campaign.scenario(number).unwrap();
    let scenarios: Vec<_> = (0..700).map(draw).collect();
    let components: BTreeSet<String> =
        scenarios.iter().map(|s| s.faults[0].component.to_string()).collect();
    assert_eq!(components.len(), 24, "every component has its turn");
    for scenario in &scenarios {
        assert_eq!(*scenario, draw(scenario.number));
        let fault = &scenario.faults[0];
        assert!((3500..=4000).contains(&fault.at.0));
        fault.fault.check().unwrap();
        match fault.fault {
            Fault::ExternalLeakageA { area_m2 } => assert!((1e-7..=5e-7).contains(&area_m2)),
            // the longest gage measures 10.2 m
            Fault::Bias { offset_m } => assert!((0.0..=100e-6 * 10.2).contains(&offset_m)),
            Fault::RandomWalk { increment_m, .. } => {
                assert!((3.0e-6..=3.0e-6 * 10.2).contains(&increment_m));
            }
            _ => {}
        }
    }
    for &kind in FaultKind::OF_RESIDUALS {
        let of_kind = scenarios.iter().filter(|s| s.faults[0].fault.kind() == kind);
        assert_eq!(of_kind.count(), 100);
    }
    let other = self::campaign(0.0, 43);
    assert_ne!(other.scenario(0).unwrap(), draw(0));
}

#[test]
fn records_do_not_depend_on_how_many_run_side_by_side() {
    let campaign = campaign(0.1, 42);
    assert_eq!(tower::rows(&campaign, 0..6, 1), tower::rows(&campaign, 0..6, 3));
}

#[test]
fn a_record_tells_what_was_injected_and_what_was_named() {
    let campaign = campaign(0.0, 42);
    // 3 is a hard-over, which no setting could miss; 6 a zero output, whose gage has a reading
    let record = tower::row(&campaign, 3);
    assert_eq!(record.kind(), Some(FaultKind::HardOver));
    assert!(record.is_exact(), "{record:?}");
    assert!(record.detection_delay().is_some_and(|steps| steps <= 5));
    assert_eq!(record.verdict_delay(), record.detection_delay().map(|steps| steps + 6));
    assert!(record.reading_over_noise.is_none());
    let record = tower::row(&campaign, 6);
    assert_eq!(record.kind(), Some(FaultKind::ZeroOutput));
    assert!(record.reading_over_noise.is_some_and(|ratio| ratio.is_finite() && ratio > 0.0));
}

#[test]
fn nominal_runs_are_quiet_and_other_runs_than_the_scenarios() {
    let campaign = campaign(0.0, 42);
    let record = tower::row(&campaign, campaign.scenarios);
    assert!(!record.is_false_alarm() && record.kind().is_none(), "{record:?}");
    assert!(record.closest.is_some_and(|closest| (0.0..1.0).contains(&closest.ratio)));
    assert_ne!(record.seed, campaign.draw(0, None).unwrap().seed);
}
