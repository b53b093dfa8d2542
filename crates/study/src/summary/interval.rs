//! How sure a share is.

use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF};

/// An interval that covers the truth in at least 95 of 100 cases: lower and upper end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Interval95(pub f64, pub f64);

/// The interval of a share of which `part` of `all` is an observation (Clopper and Pearson 1934:
/// exact, never too narrow). From 0 to 1 if nothing was observed.
#[must_use]
pub fn share_interval(part: u64, all: u64) -> Interval95 {
    let (part, rest) = (part as f64, all.saturating_sub(part) as f64);
    let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).ok().map(|beta| beta.inverse_cdf(p));
    let lower = quantile(part, rest + 1.0, 0.025).filter(|_| part > 0.0);
    let upper = quantile(part + 1.0, rest, 0.975).filter(|_| rest > 0.0);
    Interval95(lower.unwrap_or(0.0), upper.unwrap_or(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

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

    #[test]
    fn nothing_observed_is_nothing_known() {
        assert_eq!(share_interval(0, 0), Interval95(0.0, 1.0));
    }
}
