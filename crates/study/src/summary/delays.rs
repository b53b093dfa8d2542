//! How long it takes: median, 95 % and the longest.

use std::collections::BTreeMap;

use names::fault::FaultKind;
use serde::Serialize;

use crate::quantile::nearest_rank;
use crate::record::ScenarioRecord;

/// Delays of those that were named \[ms\]; `None` if none was. Quantiles are the nearest rank.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Delays {
    /// Half of them take no longer.
    pub median: Option<f64>,
    /// 95 of 100 take no longer.
    pub p95: Option<f64>,
    /// The longest.
    pub max: Option<f64>,
}

impl Delays {
    /// Of delays in steps of `step_s`.
    #[must_use]
    pub fn of(delays: impl Iterator<Item = u64>, step_s: f64) -> Self {
        let mut sorted: Vec<u64> = delays.collect();
        sorted.sort_unstable();
        let at = |share: f64| {
            let steps = nearest_rank(&sorted, share)?;
            Some(round(steps as f64 * step_s * 1e3))
        };
        Self { median: at(0.5), p95: at(0.95), max: at(1.0) }
    }
}

/// A thousandth of a millisecond is finer than any step.
fn round(milliseconds: f64) -> f64 {
    (milliseconds * 1e3).round() / 1e3
}

/// The delays of each kind of fault.
pub(super) fn by_kind(
    scenarios: &[&ScenarioRecord],
    step_s: f64,
    delay: impl Fn(&ScenarioRecord) -> Option<u64>,
) -> BTreeMap<FaultKind, Delays> {
    let mut kinds: BTreeMap<FaultKind, Vec<u64>> = BTreeMap::new();
    for record in scenarios {
        kinds.entry(record.kind()).or_default().extend(delay(record));
    }
    kinds.into_iter().map(|(kind, delays)| (kind, Delays::of(delays.into_iter(), step_s))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_values_that_occurred() {
        let delays = Delays::of([5, 1, 3, 2, 4].into_iter(), 1e-3);
        assert_eq!(delays, Delays { median: Some(3.0), p95: Some(5.0), max: Some(5.0) });
        let delays = Delays::of(1..=100, 1e-3);
        assert_eq!(delays, Delays { median: Some(50.0), p95: Some(95.0), max: Some(100.0) });
        assert_eq!(Delays::of(std::iter::empty(), 1e-3), Delays::default());
    }
}
