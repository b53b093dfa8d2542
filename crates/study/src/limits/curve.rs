//! What is measured, and the curves that follow from it.

use serde::Serialize;

use crate::quantile::nearest_rank;

/// The share of the runs that a limit holds for.
const SURELY: f64 = 0.95;

/// One of the two answers of a diagnoser.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Detector {
    /// The change detector: its faults jump in. *Found* is a change that no other fault explains, *right* one that is
    /// declared a fault of its component.
    Change,
    /// The comparison with a reference: its faults are there from the first sample on. *Found* is a component that is
    /// declared faulty or one of several suspects, *right* one that is declared faulty or the likeliest of them.
    Reference,
}

impl Detector {
    /// Both.
    pub const ALL: [Detector; 2] = [Detector::Change, Detector::Reference];

    /// For people.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Detector::Change => "change",
            Detector::Reference => "reference",
        }
    }
}

/// A kind of fault that has a size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SizedKind {
    /// Offset of a gage, either way \[µε\].
    Bias,
    /// Leak from chamber to chamber \[m²\].
    InternalLeakage,
    /// Leak from either chamber to the outside \[m²\].
    ExternalLeakage,
}

impl SizedKind {
    /// All of them.
    pub const ALL: [SizedKind; 3] =
        [SizedKind::Bias, SizedKind::InternalLeakage, SizedKind::ExternalLeakage];

    /// For people.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            SizedKind::Bias => "bias",
            SizedKind::InternalLeakage => "internal leakage",
            SizedKind::ExternalLeakage => "external leakage",
        }
    }

    /// Unit of the size.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            SizedKind::Bias => "µε",
            SizedKind::InternalLeakage | SizedKind::ExternalLeakage => "m²",
        }
    }

    /// The sizes that are tried, ascending.
    #[must_use]
    pub fn sizes(self) -> &'static [f64] {
        match self {
            SizedKind::Bias => &[0.5, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0],
            SizedKind::InternalLeakage | SizedKind::ExternalLeakage => {
                &[1e-9, 2e-9, 5e-9, 1e-8, 2e-8, 5e-8, 1e-7]
            }
        }
    }
}

/// How one detector does against one kind of fault.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LimitCurve {
    /// The detector.
    pub detector: Detector,
    /// The kind.
    pub kind: SizedKind,
    /// Unit of its sizes.
    pub unit: &'static str,
    /// The sizes tried, ascending.
    pub points: Vec<LimitPoint>,
    /// The smallest size found in 95 % of the runs against the time, and so are all larger ones. Times ascend, sizes
    /// descend; each holds from its time on until the next.
    pub found: Vec<Within>,
    /// The smallest size of which the right component is known, likewise.
    pub right: Vec<Within>,
}

/// What became of the runs with a fault of one size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LimitPoint {
    /// Size of the fault, in the unit of the curve.
    pub size: f64,
    /// How many runs.
    pub runs: u64,
    /// Those in which it is found.
    pub found: Reached,
    /// Those in which the right component is known.
    pub right: Reached,
}

/// In how many runs something is so by their end, and since when.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Reached {
    /// How many.
    pub count: u64,
    /// In 95 % of all runs it is so within this time from the fault's first sample on, which counts as one step \[s\];
    /// `None` if it is in fewer.
    pub within_s: Option<f64>,
}

/// A size that is reached within a time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Within {
    /// The time \[s\].
    pub within_s: f64,
    /// The size, in the unit of the curve.
    pub size: f64,
}

impl LimitCurve {
    pub(super) fn of(detector: Detector, kind: SizedKind, points: Vec<LimitPoint>) -> Self {
        let found = smallest_sizes(&points, |point| point.found);
        let right = smallest_sizes(&points, |point| point.right);
        Self { detector, kind, unit: kind.unit(), points, found, right }
    }
}

impl Reached {
    /// Of the times of all runs, in steps of `step_s`.
    pub(super) fn of(mut times: Vec<Option<u64>>, step_s: f64) -> Self {
        times.sort_unstable_by_key(|time| time.unwrap_or(u64::MAX));
        // A billionth of a second is finer than any step.
        let seconds = |steps: u64| (steps as f64 * step_s * 1e9).round() / 1e9;
        Self {
            count: times.iter().flatten().count() as u64,
            within_s: nearest_rank(&times, SURELY).flatten().map(seconds),
        }
    }
}

/// From the largest size downwards, as far as 95 % are reached. One that takes less time than a larger one is as slow.
fn smallest_sizes(points: &[LimitPoint], of: impl Fn(&LimitPoint) -> Reached) -> Vec<Within> {
    let mut sizes: Vec<Within> = Vec::new();
    for point in points.iter().rev() {
        let Some(time) = of(point).within_s else { break };
        let within_s = sizes.last().map_or(time, |larger| larger.within_s.max(time));
        // The smaller of two that take the same time is the limit.
        sizes.pop_if(|larger| larger.within_s == within_s);
        sizes.push(Within { within_s, size: point.size });
    }
    sizes
}

/// The smallest size that a curve reaches within a time.
#[must_use]
pub fn smallest_within(curve: &[Within], time_s: f64) -> Option<f64> {
    curve.iter().rev().find(|step| step.within_s <= time_s).map(|step| step.size)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(size: f64, within_s: Option<f64>) -> LimitPoint {
        let reached = Reached { count: 0, within_s };
        LimitPoint { size, runs: 0, found: reached, right: reached }
    }

    #[test]
    fn a_time_is_that_of_nineteen_runs_in_twenty() {
        let of = |missed: usize| {
            let times = (0..20).map(|run| (run >= missed).then_some(run as u64));
            Reached::of(times.collect(), 1e-3)
        };
        assert_eq!(of(0), Reached { count: 20, within_s: Some(0.018) });
        assert_eq!(of(1), Reached { count: 19, within_s: Some(0.019) });
        assert_eq!(of(2), Reached { count: 18, within_s: None });
        assert_eq!(Reached::of(Vec::new(), 1e-3), Reached { count: 0, within_s: None });
    }

    #[test]
    fn smaller_sizes_take_longer_and_end_where_one_is_not_reached() {
        let points = [
            point(0.5, Some(9.0)),
            point(1.0, None),
            point(2.0, Some(4.0)),
            point(3.0, Some(2.0)),
            point(5.0, Some(3.0)),
            point(7.0, Some(1.0)),
        ];
        let curve = smallest_sizes(&points, |point| point.found);
        let steps: Vec<_> = curve.iter().map(|step| (step.within_s, step.size)).collect();
        assert_eq!(steps, [(1.0, 7.0), (3.0, 3.0), (4.0, 2.0)]);
        let at = [0.9, 1.0, 3.5, 10.0].map(|time| smallest_within(&curve, time));
        assert_eq!(at, [None, Some(7.0), Some(3.0), Some(2.0)]);
    }
}
