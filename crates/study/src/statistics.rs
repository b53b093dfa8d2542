//! Quantiles, intervals of shares, delays.
//!
//! A quantile is one of the values; the three functions differ in which of two neighbours they choose. Published
//! results were computed with each of them, so all three stay.

use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF, Gamma};

/// The smallest value that at least this share of all values does not exceed (nearest rank).
pub(crate) fn nearest_rank<T: Copy>(sorted: &[T], share: f64) -> Option<T> {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.saturating_sub(1)).copied()
}

/// The value nearest to this share of the range from the first to the last index; of two equally near, the larger.
pub(crate) fn on_the_way<T: Copy>(sorted: &[T], share: f64) -> Option<T> {
    let last = sorted.len().checked_sub(1)?;
    sorted.get((share * last as f64).round() as usize).copied()
}

/// The first value beyond this share of all values.
pub(crate) fn first_beyond<T: Copy>(sorted: &[T], share: f64) -> Option<T> {
    sorted.get((share * sorted.len() as f64) as usize).copied()
}

/// An interval that covers the true value in at least 95 of 100 cases: lower and upper end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Interval95(pub f64, pub f64);

/// The interval without observations.
impl Default for Interval95 {
    fn default() -> Self {
        Self(0.0, 1.0)
    }
}

/// The interval of a share of which `part` of `all` is an observation (Clopper and Pearson 1934: exact, never too
/// narrow). From 0 to 1 without observations.
#[must_use]
pub fn share_interval(part: u64, all: u64) -> Interval95 {
    let (part, rest) = (part as f64, all.saturating_sub(part) as f64);
    let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).ok().map(|beta| beta.inverse_cdf(p));
    let lower = quantile(part, rest + 1.0, 0.025).filter(|_| part > 0.0);
    let upper = quantile(part + 1.0, rest, 0.975).filter(|_| rest > 0.0);
    Interval95(lower.unwrap_or(0.0), upper.unwrap_or(1.0))
}

/// The interval of the expected number of rare events of which so many were observed (Garwood 1936).
#[must_use]
pub fn rate_interval(count: u64) -> Interval95 {
    let quantile = |shape: f64, p: f64| Gamma::new(shape, 1.0).ok().map(|of| of.inverse_cdf(p));
    let lower = quantile(count as f64, 0.025).filter(|_| count > 0);
    let upper = quantile(count as f64 + 1.0, 0.975);
    Interval95(lower.unwrap_or(0.0), upper.unwrap_or(f64::INFINITY))
}

/// Delays in milliseconds; `None` without delays. Quantiles are the nearest rank.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Delays {
    /// The median.
    pub median: Option<f64>,
    /// The 95th percentile.
    pub p95: Option<f64>,
    /// The longest.
    pub max: Option<f64>,
}

impl Delays {
    /// The statistics of delays in steps of `step_s`.
    #[must_use]
    pub fn of(delays: impl Iterator<Item = u64>, step_s: f64) -> Self {
        let mut sorted: Vec<u64> = delays.collect();
        sorted.sort_unstable();
        let at = |share: f64| {
            let steps = nearest_rank(&sorted, share)?;
            // Rounded to a microsecond, which is finer than any step.
            Some((steps as f64 * step_s * 1e3 * 1e3).round() / 1e3)
        };
        Self { median: at(0.5), p95: at(0.95), max: at(1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conventions_differ_in_the_neighbour_that_they_take() {
        let of = |sorted: &[u8], share: f64| {
            [nearest_rank(sorted, share), on_the_way(sorted, share), first_beyond(sorted, share)]
        };
        assert_eq!(of(&[1, 2, 3, 4], 0.5), [Some(2), Some(3), Some(3)]);
        assert_eq!(of(&[1, 2, 3, 4, 5], 0.5), [Some(3); 3]);
        assert_eq!(of(&[1, 2, 3, 4], 0.0), [Some(1); 3]);
        assert_eq!(of(&[1, 2, 3, 4], 1.0), [Some(4), Some(4), None]);
        assert_eq!(of(&[], 0.5), [None; 3]);
    }

    #[test]
    fn quantiles_of_delays_are_values_that_occurred() {
        let delays = Delays::of([5, 1, 3, 2, 4].into_iter(), 1e-3);
        assert_eq!(delays, Delays { median: Some(3.0), p95: Some(5.0), max: Some(5.0) });
        let delays = Delays::of(1..=100, 1e-3);
        assert_eq!(delays, Delays { median: Some(50.0), p95: Some(95.0), max: Some(100.0) });
        assert_eq!(Delays::of(std::iter::empty(), 1e-3), Delays::default());
    }

    fn close(part: u64, all: u64, lower: f64, upper: f64) {
        let Interval95(a, b) = share_interval(part, all);
        assert!((a - lower).abs() < 1e-9 && (b - upper).abs() < 1e-9, "{part}/{all}: {a} {b}");
    }

    /// `scipy.stats.binomtest(k, n).proportion_ci(0.95, "exact")`, SciPy 1.17.1.
    #[test]
    fn agrees_with_scipy() {
        SCIPY.iter().for_each(|&(part, all, lower, upper)| close(part, all, lower, upper));
    }

    const SCIPY: [(u64, u64, f64, f64); 5] = [
        (0, 300, 0.0, 0.012220974694296421),
        (1, 300, 8.438913231782062e-5, 0.01843125204806789),
        (297, 300, 0.9710554887443072, 0.9979329927649077),
        (300, 300, 0.9877790253057036, 1.0),
        (7, 30, 0.09933786495802023, 0.42283652297821944),
    ];

    /// `scipy.stats.chi2.ppf([0.025, 0.975], [2 n, 2 n + 2]) / 2`, SciPy 1.17.1.
    #[test]
    fn rates_agree_with_scipy() {
        for (count, low, high) in [
            (0, 0.0, 3.688_879_454_113_936),
            (1, 0.025_317_807_984_289_897, 5.571_643_390_938_845),
            (10, 4.795_388_695_132_594, 18.390_356_011_547_88),
        ] {
            let Interval95(a, b) = rate_interval(count);
            assert!((a - low).abs() < 1e-6 && (b - high).abs() < 1e-6, "{count}: {a} {b}");
        }
    }

    #[test]
    fn nothing_observed_is_nothing_known() {
        assert_eq!(share_interval(0, 0), Interval95(0.0, 1.0));
    }
}
