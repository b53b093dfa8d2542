//! Property: no finite series makes an identification panic, whatever its sizes, gaps and noise, and what comes out are
//! probabilities and intervals.

use proptest::prelude::*;
use vocabulary::{Component, IdentifiedKind, RunId, Step};

use super::level::Prior;
use super::{
    CylinderSeries, CylinderStep, Excerpt, FaultOnset, GageSeries, GageStep, MeasuredSeries,
    identify,
};
use crate::testing::hydraulics;

/// Sizes from the smallest number to the largest, usual ones more often.
fn size() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => (-12.0..8.0_f64).prop_map(|power| 10_f64.powf(power)),
        1 => (-323.0..308.0_f64).prop_map(|power| 10_f64.powf(power)),
        1 => Just(f64::MAX),
        1 => Just(f64::MIN_POSITIVE),
        2 => Just(0.0),
    ]
}

/// A level, noise on it, a step of it and the resolution, as a function of the count and of numbers between -1 and 1.
fn values(count: usize) -> impl Strategy<Value = Vec<f64>> {
    let noise = prop::collection::vec(-1.0..1.0_f64, count);
    let sizes = (size(), size(), size(), size(), size());
    (noise, sizes, 0.0..1.0_f64, any::<bool>()).prop_map(
        move |(noise, (level, deviation, jump, slope, resolution), at, two_valued)| {
            let value = |(k, noise): (usize, f64)| {
                let noise = if two_valued { noise.signum() } else { noise };
                let jumped = if k as f64 >= at * count as f64 { jump } else { 0.0 };
                let value = level + deviation * noise + jumped + slope * k as f64;
                let value = if resolution > 0.0 && (value / resolution).is_finite() {
                    (value / resolution).round() * resolution
                } else {
                    value
                };
                value.clamp(f64::MIN, f64::MAX)
            };
            noise.into_iter().enumerate().map(value).collect()
        },
    )
}

/// Steps at which there is a value: all, all but some, a few.
fn steps(count: usize) -> impl Strategy<Value = Vec<Step>> {
    let gap = prop_oneof![8 => Just(1_u64), 1 => 2..200_u64];
    (0..1000_u64, prop::collection::vec(gap, count)).prop_map(|(first, gaps)| {
        let mut step = first;
        let next = |gap: u64| {
            step += gap;
            Step(step)
        };
        gaps.into_iter().map(next).collect()
    })
}

fn seen() -> impl Strategy<Value = FaultOnset> {
    let detection = 0..2500_u64;
    prop_oneof![
        (detection.clone(), 0..300_u64).prop_map(|(detection, before)| FaultOnset::Change {
            onset: Step(detection.saturating_sub(before)),
            detection: Step(detection),
        }),
        detection.prop_map(|detection| FaultOnset::Departure { detection: Step(detection) }),
    ]
}

fn counts() -> impl Strategy<Value = usize> {
    prop_oneof![Just(0_usize), 1..5_usize, 5..60_usize, 500..2000_usize]
}

fn excerpt(component: &str, seen: FaultOnset, step_s: f64, measured: MeasuredSeries) -> Excerpt {
    let component: Component = component.parse().unwrap();
    let (run, as_of) = (RunId(1), Step(4000));
    Excerpt { run, sequence: 1, component, as_of, step_s, seen, measured }
}

fn gage() -> impl Strategy<Value = Excerpt> {
    let prior = (size(), size()).prop_map(|(mean, deviation)| Prior { mean, deviation });
    let of_steps = counts().prop_flat_map(|count| (steps(count), values(count), values(count)));
    let of_seconds = (0..6_usize).prop_flat_map(|count| (steps(count), values(count)));
    // As a configuration may have it.
    let noise_m = (-12.0..0.0_f64).prop_map(|power| 10_f64.powf(power));
    let step_s = prop_oneof![Just(1e-4), Just(1e-3), Just(0.2), Just(1.0)];
    (of_steps, of_seconds, prior, noise_m, step_s, seen()).prop_map(
        |((steps, off, readings), (seconds, means), level_m, noise_m, step_s, seen)| {
            let step = |(step, (off_m, reading_m)): (Step, (f64, f64))| {
                GageStep { step, off_m, reading_m }.if_usable()
            };
            let second = |(until, value): (Step, f64)| GageStep {
                step: until.plus(4000),
                off_m: value,
                reading_m: value,
            };
            let steps = steps.into_iter().zip(off.into_iter().zip(readings)).filter_map(step);
            let seconds = seconds.into_iter().zip(means).map(second).collect();
            let series = GageSeries { steps: steps.collect(), seconds, level_m, noise_m };
            excerpt("sensor/g1", seen, step_s, MeasuredSeries::Gage(series))
        },
    )
}

fn cylinder() -> impl Strategy<Value = Excerpt> {
    let of_steps =
        counts().prop_flat_map(|count| (steps(count), values(count), values(count), values(count)));
    let step_s = prop_oneof![Just(1e-4), Just(1e-3), Just(0.2)];
    (of_steps, size(), step_s, seen()).prop_map(|((steps, demands, a, b), null, step_s, seen)| {
        let step = |(step, (demand_n, (a, b))): (Step, (f64, (f64, f64)))| {
            CylinderStep { step, demand_n, pressures_pa: [a, b] }.if_usable()
        };
        let all = steps.into_iter().zip(demands.into_iter().zip(a.into_iter().zip(b)));
        let series = CylinderSeries {
            steps: all.filter_map(step).collect(),
            hydraulics: hydraulics(),
            null_flow: Prior::about_zero(null),
        };
        excerpt("actuator/a1", seen, step_s, MeasuredSeries::Cylinder(series))
    })
}

fn check(excerpt: &Excerpt) -> Result<(), TestCaseError> {
    let found = identify(excerpt, None);
    let all: f64 = found.candidates.iter().map(|candidate| candidate.probability).sum();
    prop_assert!(all <= 1.0 + 1e-9, "{found:?}");
    for candidate in &found.candidates {
        prop_assert!(candidate.probability > 0.0, "{found:?}");
        prop_assert!(candidate.probability.is_finite(), "{found:?}");
        if let Some(size) = candidate.size {
            prop_assert!(candidate.kind != IdentifiedKind::NoneOfThese, "{found:?}");
            prop_assert!(size.low <= size.value && size.value <= size.high, "{found:?}");
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 192, failure_persistence: None, ..Default::default() })]

    #[test]
    fn no_series_of_a_gage_makes_its_identification_panic(excerpt in gage()) {
        check(&excerpt)?;
    }

    #[test]
    fn no_series_of_a_cylinder_makes_its_identification_panic(excerpt in cylinder()) {
        check(&excerpt)?;
    }
}
