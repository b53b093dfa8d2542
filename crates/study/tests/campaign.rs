//! Campaigns on the shipped tower.

use std::collections::BTreeSet;
use std::sync::atomic::AtomicBool;

use crate::tower;
use names::fault::{Fault, FaultKind};
use study::{Campaign, ScenarioRanges, ScenarioRecord, parallel};

fn campaign(mismatch: f64) -> Campaign {
    let (structure, parameters, setups) = tower::parts();
    let ranges = ScenarioRanges { length_s: 5.0, onset_s: [3.5, 4.0], ..ScenarioRanges::default() };
    Campaign { structure, parameters, setups, mismatch, controllers: Vec::new(), seed: 42, ranges }
}

#[test]
fn scenarios_follow_from_seed_and_number_alone_and_stay_within_their_ranges() {
    let campaign = campaign(0.0);
    let draw = |number| campaign.scenario(number).unwrap();
    let scenarios: Vec<_> = (0..700).map(draw).collect();
    let components: BTreeSet<String> =
        scenarios.iter().map(|s| s.injection.component.to_string()).collect();
    assert_eq!(components.len(), 24, "every component has its turn");
    for scenario in &scenarios {
        assert_eq!(*scenario, draw(scenario.number));
        let onset = scenario.injection.at.0;
        assert!((3500..=4000).contains(&onset));
        scenario.injection.fault.check().unwrap();
        match scenario.injection.fault {
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
        assert_eq!(scenarios.iter().filter(|s| s.kind() == kind).count(), 100);
    }
    let other = Campaign { seed: 43, ..campaign.clone() };
    assert_ne!(other.scenario(0).unwrap(), draw(0));
}

#[test]
fn records_do_not_depend_on_how_many_run_side_by_side() {
    let campaign = campaign(0.1);
    let run = |jobs| {
        let numbers: Vec<u64> = (0..6).collect();
        let mut records: Vec<ScenarioRecord> = Vec::new();
        let work = |&number: &u64| campaign.run_scenario(number);
        let keep = |_: &u64, record| {
            records.push(record);
            Ok(())
        };
        parallel::for_each(&numbers, jobs, &AtomicBool::new(false), work, keep).unwrap();
        records.sort_by_key(|record| record.number);
        records
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn a_record_tells_what_was_injected_and_what_was_named() {
    let campaign = campaign(0.0);
    // 3 is a hard-over, which no setting could miss; 6 a zero output, whose gage has a reading
    let record = campaign.run_scenario(3).unwrap();
    assert_eq!(record.kind(), FaultKind::HardOver);
    assert!(record.is_exact(), "{record:?}");
    assert!(record.detection_delay().is_some_and(|steps| steps <= 5));
    assert_eq!(record.verdict_delay(), record.detection_delay().map(|steps| steps + 6));
    assert!(record.reading_over_noise.is_none());
    let record = campaign.run_scenario(6).unwrap();
    assert_eq!(record.kind(), FaultKind::ZeroOutput);
    assert!(record.reading_over_noise.is_some_and(|ratio| ratio.is_finite() && ratio > 0.0));
}

#[test]
fn nominal_runs_are_quiet_and_other_runs_than_the_scenarios() {
    let campaign = campaign(0.0);
    let record = campaign.run_nominal(0).unwrap();
    assert!(!record.is_false_alarm(), "{record:?}");
    assert_ne!(record.seed, campaign.scenario(0).unwrap().seed);
}
