//! Power: what a curve reports follows from its runs, and large faults are found.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use crate::tower;
use study::{Campaign, PowerCurve, ScenarioRanges, SizedFault, measure_power};

const RUNS: u64 = 3;

fn campaign() -> Campaign {
    let (structure, parameters, setups) = tower::parts();
    let ranges = ScenarioRanges::default();
    Campaign {
        structure,
        parameters,
        setups,
        mismatch: 0.0,
        controllers: Vec::new(),
        seed: 4,
        ranges,
    }
}

fn measured(fault: SizedFault, jobs: usize) -> PowerCurve {
    let never = AtomicBool::new(false);
    measure_power(&campaign(), fault, RUNS, jobs, &never, || ()).unwrap().unwrap()
}

#[test]
fn a_curve_rises_from_never_to_always() {
    for fault in [SizedFault::Bias, SizedFault::Leakage] {
        let curve = measured(fault, 2);
        assert_eq!(curve.points.len(), fault.sizes().len());
        let (first, last) = (curve.points[0], curve.points[curve.points.len() - 1]);
        assert_eq!((first.probability, first.median_delay_ms), (0.0, None), "{}", curve.title);
        assert_eq!(last.probability, 1.0, "{}", curve.title);
        let smallest = curve.smallest_95.unwrap();
        assert!(first.size < smallest && smallest <= last.size);
        for point in &curve.points {
            assert!((point.low..=point.high).contains(&point.probability));
            assert!(point.size < smallest || point.probability >= 0.95);
            assert_eq!(point.median_delay_ms.is_some(), point.probability > 0.0);
            // what is found is found within a second
            assert!(point.median_delay_ms.is_none_or(|delay| (0.0..=1000.0).contains(&delay)));
        }
    }
}

#[test]
fn the_number_of_jobs_does_not_matter() {
    assert_eq!(measured(SizedFault::RandomWalk, 1), measured(SizedFault::RandomWalk, 2));
}

#[test]
fn a_curve_that_is_stopped_is_no_curve() {
    let (stop, made) = (AtomicBool::new(false), AtomicUsize::new(0));
    let done = || {
        made.fetch_add(1, Ordering::Relaxed);
        stop.store(true, Ordering::Relaxed);
    };
    let curve = measure_power(&campaign(), SizedFault::Bias, RUNS, 1, &stop, done).unwrap();
    assert_eq!((curve, made.into_inner()), (None, 1));
}
