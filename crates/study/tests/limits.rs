//! Limits of detectors on the tower: larger faults are found, and no later than smaller ones.

use crate::tower;
use study::limits::{
    LimitCampaign, LimitCurve, LimitDetector, LimitQuestion, SizedKind, smallest_within,
};
use study::{Campaign, Done};

const RUNS: u64 = 4;

fn limits(plants: u64, curves: &[(LimitDetector, SizedKind, &[f64])]) -> LimitCampaign {
    let questions = curves.iter().flat_map(|(detector, kind, sizes)| {
        let (system, detector, kind) = (0, *detector, *kind);
        sizes.iter().map(move |size| LimitQuestion { system, detector, kind, size: *size })
    });
    let questions = questions.collect();
    LimitCampaign { systems: vec![tower::system(0.1, 20_261_202)], plants, runs: RUNS, questions }
}

fn measured(limits: &LimitCampaign, jobs: usize) -> Vec<LimitCurve> {
    limits.summarize(&tower::rows(limits, 0..limits.cases(), jobs)).curves
}

#[test]
fn larger_faults_are_found_no_later_whatever_the_number_of_jobs() {
    let cases: [(_, _, &[f64]); 4] = [
        (LimitDetector::Change, SizedKind::Bias, &[0.2, 30.0]),
        (LimitDetector::Reference, SizedKind::Bias, &[3.0, 30.0]),
        (LimitDetector::Reference, SizedKind::InternalLeakage, &[1e-8, 1e-7]),
        (LimitDetector::Reference, SizedKind::ExternalLeakage, &[1e-8, 1e-7]),
    ];
    let limits = limits(1, &cases);
    let curves = measured(&limits, 2);
    assert_eq!(curves, measured(&limits, 1));
    for (curve, (detector, _, sizes)) in curves.iter().zip(cases) {
        let within_s = if detector == LimitDetector::Change { 0.1 } else { 4.0 };
        let [small, large] = &curve.points[..] else { panic!("{curve:?}") };
        assert_eq!((large.found.count, large.right.count), (RUNS, RUNS), "{curve:?}");
        let time = large.found.within_s.unwrap();
        assert!(time > 0.0 && time <= within_s, "{curve:?}");
        assert!(small.found.within_s.is_none_or(|longer| longer >= time), "{curve:?}");
        assert!(small.right.count <= small.found.count && large.right.within_s >= Some(time));
        assert!(smallest_within(&curve.found, within_s).unwrap() <= sizes[1]);
        assert_eq!(smallest_within(&curve.found, 0.0), None);
        // A fifth of the noise is beyond the change detector.
        let is_blind = detector == LimitDetector::Change;
        assert_eq!(small.found.count == 0, is_blind, "{curve:?}");
    }
}

#[test]
fn without_plants_there_are_no_limits() {
    let limits = limits(0, &[(LimitDetector::Change, SizedKind::Bias, &[1.0])]);
    assert_eq!(limits.plant_of(0), (0, None));
    let mut done = Done::default();
    tower::engine(1).run(&limits, 0..0, &mut done, None).unwrap();
    assert!(limits.summarize(&done.rows).curves[0].found.is_empty());
}

#[test]
fn isolation_rises_from_never_to_always() {
    let kinds = [SizedKind::BiasInNoise, SizedKind::LeakInNoise];
    let sizes = kinds.map(SizedKind::sizes);
    let curves = [0, 1].map(|place| (LimitDetector::Isolation, kinds[place], &sizes[place][..]));
    let limits =
        LimitCampaign { runs: 3, systems: vec![tower::system(0.0, 4)], ..limits(0, &curves) };
    for curve in measured(&limits, 2) {
        assert_eq!(curve.points.len(), curve.kind.sizes().len());
        let (first, last) = (&curve.points[0], &curve.points[curve.points.len() - 1]);
        assert_eq!((first.right.count, first.right.median_delay_ms), (0, None), "{curve:?}");
        assert_eq!(last.right.count, last.runs, "{curve:?}");
        let smallest = curve.smallest().unwrap();
        assert!(first.size < smallest && smallest <= last.size);
        for point in &curve.points {
            let share = point.right.count as f64 / point.runs as f64;
            assert!((point.right.share_95.0..=point.right.share_95.1).contains(&share));
            assert!(point.size < smallest || share >= 0.95);
            // what is found is found within a second
            let delay = point.right.median_delay_ms;
            assert!(delay.is_none_or(|delay| (0.0..=1000.0).contains(&delay)));
            assert_eq!(delay.is_some(), point.right.count > 0);
        }
    }
}
