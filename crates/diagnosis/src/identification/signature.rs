//! What was measured of a fault, and what its likeliest hypothesis makes of it: for people to see how well that fits.

use vocabulary::{SignaturePoint, Step};

/// Equal stretches of time of which a signature has a point each, and one more for that in which the onset is.
const MOST: usize = 119;
/// How much of the time before the onset belongs to it, as a share of the time after it; and no less than this \[s\].
const BEFORE: f64 = 0.25;
const LEAST_BEFORE_S: f64 = 0.05;

/// A signature from a series: times \[s\] in ascending order, what was measured, what is fitted. `step_at` tells the step at
/// a time.
pub(super) fn signature(
    series: &[(f64, f64, f64)],
    onset_s: f64,
    step_at: impl Fn(f64) -> Step,
) -> Vec<SignaturePoint> {
    let Some((last_s, _, _)) = series.last() else { return Vec::new() };
    let from_s = onset_s - (BEFORE * (last_s - onset_s)).max(LEAST_BEFORE_S);
    let shown = &series[series.partition_point(|(at_s, _, _)| *at_s < from_s)..];
    let Some((first_s, _, _)) = shown.first() else { return Vec::new() };
    let width_s = (last_s - first_s) / MOST as f64;
    let stretch = |at_s: f64| ((at_s - first_s) / width_s).min((MOST - 1) as f64) as usize;
    // What is before and after the onset stays apart.
    let part = |at_s: f64| (at_s < onset_s, stretch(at_s));
    let together = |a: &(f64, f64, f64), b: &(f64, f64, f64)| part(a.0) == part(b.0);
    let point = |stretch: &[(f64, f64, f64)]| {
        let mean = |of: fn(&(f64, f64, f64)) -> f64| {
            stretch.iter().map(of).sum::<f64>() / stretch.len() as f64
        };
        let (measured, fitted) = (mean(|point| point.1), mean(|point| point.2));
        SignaturePoint { step: step_at(mean(|point| point.0)), measured, fitted }
    };
    shown.chunk_by(together).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_series_becomes_means_over_equal_stretches_from_before_the_onset_on() {
        let series: Vec<(f64, f64, f64)> =
            (0..10_000).map(|k| (1e-3 * k as f64 - 8.0, k as f64, -(k as f64))).collect();
        let points = signature(&series, 0.0, |at_s| Step(((at_s + 8.0) * 1e3).round() as u64));
        assert_eq!(points.len(), MOST + 1);
        assert!((points[0].measured - 7510.0).abs() < 2.0, "{:?}", points[0]);
        assert!(points.iter().all(|point| (point.measured + point.fitted).abs() < 1e-9));
        assert!(points.iter().all(|point| (point.measured - point.step.0 as f64).abs() <= 0.5));
        assert!(signature(&[], 0.0, |_| Step(0)).is_empty());
        assert_eq!(signature(&series[..1], -8.0, |_| Step(0)).len(), 1);
    }
}
