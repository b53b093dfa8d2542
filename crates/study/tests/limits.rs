//! Limits of both detectors on one commissioned tower: larger faults are found, and no later than smaller ones.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::tower;
use study::StudyError;
use study::conditions::{CaseKind, CommissionedPlant, ConditionCampaign};
use study::limits::{Detector, LimitCurve, LimitStudy, SizedKind, smallest_within};

const RUNS: u64 = 4;

fn campaign() -> ConditionCampaign {
    let (structure, parameters, setups) = tower::parts();
    ConditionCampaign {
        structure,
        parameters,
        setups,
        mismatch: 0.1,
        seed: 20_261_202,
        cases_per_plant: 0,
        kind: CaseKind::default(),
    }
}

fn measured(
    (campaign, plants): (&ConditionCampaign, &[CommissionedPlant]),
    (detector, kind): (Detector, SizedKind),
    sizes: &[f64],
    jobs: usize,
) -> LimitCurve {
    let study = LimitStudy { campaign, plants, runs: RUNS };
    let never = AtomicBool::new(false);
    study.measure((detector, kind), sizes, jobs, &never, || ()).unwrap().unwrap()
}

#[test]
fn larger_faults_are_found_no_later_whatever_the_number_of_jobs() {
    let campaign = campaign();
    let plants = [campaign.commission(0, 2, &|| {}).unwrap()];
    let cases: [(_, _, &[f64], _); 4] = [
        (Detector::Change, SizedKind::Bias, &[0.2, 30.0], 0.1),
        (Detector::Reference, SizedKind::Bias, &[3.0, 30.0], 4.0),
        (Detector::Reference, SizedKind::InternalLeakage, &[1e-8, 1e-7], 4.0),
        (Detector::Reference, SizedKind::ExternalLeakage, &[1e-8, 1e-7], 4.0),
    ];
    for (detector, kind, sizes, within_s) in cases {
        let of_jobs = |jobs| measured((&campaign, &plants), (detector, kind), sizes, jobs);
        let curve = of_jobs(2);
        assert_eq!(curve, of_jobs(1));
        let [small, large] = &curve.points[..] else { panic!("{curve:?}") };
        assert_eq!((large.found.count, large.right.count), (RUNS, RUNS), "{curve:?}");
        let time = large.found.within_s.unwrap();
        assert!(time > 0.0 && time <= within_s, "{curve:?}");
        assert!(small.found.within_s.is_none_or(|longer| longer >= time), "{curve:?}");
        assert!(small.right.count <= small.found.count && large.right.within_s >= Some(time));
        assert!(smallest_within(&curve.found, within_s).unwrap() <= sizes[1]);
        assert_eq!(smallest_within(&curve.found, 0.0), None);
        // A fifth of the noise is beyond the change detector.
        let is_blind = detector == Detector::Change;
        assert_eq!(small.found.count == 0, is_blind, "{curve:?}");
    }
}

#[test]
fn limits_that_are_stopped_are_none_and_without_plants_there_are_none() {
    let campaign = campaign();
    let study = LimitStudy { campaign: &campaign, plants: &[], runs: RUNS };
    let measure = |stop: &AtomicBool| {
        let question = (Detector::Change, SizedKind::Bias);
        study.measure(question, SizedKind::Bias.sizes(), 1, stop, || ())
    };
    let stop = AtomicBool::new(false);
    assert!(matches!(measure(&stop), Err(StudyError::NothingToBreak)));
    stop.store(true, Ordering::Relaxed);
    assert_eq!(measure(&stop).unwrap(), None);
}
