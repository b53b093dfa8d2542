//! Curves computed from the runs.

use serde::Serialize;

use super::outcome::LimitRow;
use super::question::{LimitDetector, LimitQuestion, SizedKind};
use crate::report::Table;
use crate::statistics::{Delays, Interval95, nearest_rank, share_interval};

/// The share of runs for which a limit holds.
const SURELY: f64 = 0.95;

/// The times in the tables \[s\], and their names.
const TIMES: [(f64, &str); 8] = [
    (0.01, "10 ms"),
    (0.03, "30 ms"),
    (0.1, "0.1 s"),
    (0.3, "0.3 s"),
    (1.0, "1 s"),
    (3.0, "3 s"),
    (10.0, "10 s"),
    (30.0, "30 s"),
];

const FOUND: &str = "change: the fault jumps in; a change that no other fault explains. reference: it is there from the \
                     first sample on;\ndeclared faulty, or one of several suspects.";
const RIGHT: &str = "declared faulty, or the likeliest of several suspects.";

/// The measured limits.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LimitSummary {
    /// One for each system, detector and kind of fault.
    pub curves: Vec<LimitCurve>,
}

/// The performance of one detector for one kind of fault.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LimitCurve {
    /// Name of the system: its weather.
    pub weather: String,
    /// The detector.
    pub detector: LimitDetector,
    /// The kind.
    pub kind: SizedKind,
    /// Unit of its sizes.
    pub unit: &'static str,
    /// The sizes tried, ascending.
    pub points: Vec<LimitPoint>,
    /// The smallest size found in 95 % of the runs, together with all larger ones, against time. Times ascend, sizes
    /// descend; each applies from its time until the next.
    pub found: Vec<Within>,
    /// The smallest size whose component is identified, likewise.
    pub right: Vec<Within>,
}

/// The results of runs with a fault of one size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LimitPoint {
    /// Size of the fault, in the unit of the curve.
    pub size: f64,
    /// The number of runs.
    pub runs: u64,
    /// Runs in which the fault was found.
    pub found: Reached,
    /// Runs in which the right component was identified.
    pub right: Reached,
}

/// The number of runs in which a condition holds at the end, and the delays.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Reached {
    /// How many.
    pub count: u64,
    /// Interval of their share (Clopper and Pearson).
    pub share_95: Interval95,
    /// Half of these runs take at most this long from the fault's first sample on \[ms\].
    pub median_delay_ms: Option<f64>,
    /// In 95 % of all runs the condition holds within this time from the fault's first sample on, which counts as one
    /// step \[s\]; `None` if it holds in fewer runs.
    pub within_s: Option<f64>,
}

/// A size reached within a time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Within {
    /// The time \[s\].
    pub within_s: f64,
    /// The size, in the unit of the curve.
    pub size: f64,
}

impl LimitCurve {
    pub(super) fn of(weather: &str, question: &LimitQuestion, points: Vec<LimitPoint>) -> Self {
        let LimitQuestion { detector, kind, .. } = *question;
        let found = smallest_sizes(&points, |point| point.found);
        let right = smallest_sizes(&points, |point| point.right);
        Self {
            weather: weather.to_owned(),
            detector,
            kind,
            unit: kind.unit(),
            points,
            found,
            right,
        }
    }

    /// The smallest size from which on all sizes are identified in 95 % of the runs.
    #[must_use]
    pub fn smallest(&self) -> Option<f64> {
        self.right.last().map(|within| within.size)
    }
}

impl LimitPoint {
    /// The results of runs with this size, in steps of `step_s`.
    pub(super) fn of(size: f64, rows: &[LimitRow], step_s: f64) -> Self {
        let reached =
            |of: fn(&LimitRow) -> Option<u64>| Reached::of(rows.iter().map(of).collect(), step_s);
        let (found, right) = (reached(|row| row.found), reached(|row| row.right));
        Self { size, runs: rows.len() as u64, found, right }
    }
}

impl Reached {
    /// Evaluates the delays of all runs, in steps of `step_s`.
    fn of(mut delays: Vec<Option<u64>>, step_s: f64) -> Self {
        delays.sort_unstable_by_key(|delay| delay.unwrap_or(u64::MAX));
        // Rounded to a nanosecond, which is finer than any step.
        let seconds = |delay: u64| ((delay + 1) as f64 * step_s * 1e9).round() / 1e9;
        let count = delays.iter().flatten().count() as u64;
        Self {
            count,
            share_95: share_interval(count, delays.len() as u64),
            median_delay_ms: Delays::of(delays.iter().flatten().copied(), step_s).median,
            within_s: nearest_rank(&delays, SURELY).flatten().map(seconds),
        }
    }
}

/// From the largest size downwards until 95 % are not reached. A size that takes less time than a larger one is treated
/// as equally slow.
fn smallest_sizes(points: &[LimitPoint], of: impl Fn(&LimitPoint) -> Reached) -> Vec<Within> {
    let mut sizes: Vec<Within> = Vec::new();
    for point in points.iter().rev() {
        let Some(time) = of(point).within_s else { break };
        let within_s = sizes.last().map_or(time, |larger| larger.within_s.max(time));
        // Of two sizes that take the same time, the smaller is the limit.
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

/// The curves of a kind of fault, those of each detector side by side.
pub(crate) fn curves(curves: &[LimitCurve], kind: SizedKind) -> impl Iterator<Item = &LimitCurve> {
    let of_detector = move |detector| {
        curves.iter().filter(move |curve| (curve.detector, curve.kind) == (detector, kind))
    };
    [LimitDetector::Change, LimitDetector::Reference, LimitDetector::Isolation]
        .into_iter()
        .flat_map(of_detector)
}

impl LimitSummary {
    pub(super) fn tables(&self) -> Vec<Table> {
        if self.curves.iter().any(|curve| curve.detector == LimitDetector::Isolation) {
            return vec![self.minimum_isolable()];
        }
        let mut tables = vec![
            self.against_time("Smallest fault found in 95 of 100 runs within", FOUND, |c| &c.found),
            self.against_time("Smallest fault right in 95 of 100 runs within", RIGHT, |c| &c.right),
        ];
        tables.extend(SizedKind::ABSOLUTE.iter().map(|kind| self.sizes(*kind)));
        tables
    }

    fn minimum_isolable(&self) -> Table {
        let row = |curve: &LimitCurve| {
            let size =
                curve.smallest().map_or_else(|| "none tried".to_owned(), |s| format!("{s:.1}"));
            vec![curve.kind.title().to_owned(), size, curve.unit.to_owned()]
        };
        Table::new(
            "Minimum isolable fault: named in 95 of 100 runs within 1 s",
            &["fault", "size", "times"],
            self.curves.iter().map(row).collect(),
        )
    }

    fn against_time(&self, title: &str, note: &str, of: fn(&LimitCurve) -> &[Within]) -> Table {
        let all = SizedKind::ABSOLUTE.iter().flat_map(|kind| curves(&self.curves, *kind));
        let size = |size: Option<f64>| size.map_or_else(|| "–".to_owned(), number);
        let row = |curve: &LimitCurve| {
            let kind = format!("{} [{}]", curve.kind.title(), curve.unit);
            let mut row = vec![kind, curve.detector.title().to_owned(), curve.weather.clone()];
            row.extend(TIMES.map(|(time, _)| size(smallest_within(of(curve), time))));
            row
        };
        let mut heading = vec!["fault", "detector", "weather"];
        heading.extend(TIMES.map(|(_, name)| name));
        Table::new(title, &heading, all.map(row).collect()).with_note(note)
    }

    /// The time needed to find faults of each size.
    fn sizes(&self, kind: SizedKind) -> Table {
        let of_kind = || curves(&self.curves, kind);
        let names = of_kind().map(|curve| format!("{}, {}", curve.detector.title(), curve.weather));
        let heading: Vec<String> =
            [format!("size [{}]", kind.unit())].into_iter().chain(names).collect();
        let heading: Vec<&str> = heading.iter().map(String::as_str).collect();
        let rows = kind.sizes().into_iter().enumerate().map(|(place, size)| {
            let cells = of_kind().map(|of| of.points.get(place).map_or_else(String::new, time));
            [number(size)].into_iter().chain(cells).collect()
        });
        let title =
            format!("Time within which 95 of 100 are found, or how many are: {}", kind.title());
        Table::new(&title, &heading, rows.collect())
    }
}

/// With plain digits or, for sizes as small as those of leaks, as a power of ten.
fn number(size: f64) -> String {
    if size < 1e-3 { format!("{size:e}") } else { size.to_string() }
}

fn time(point: &LimitPoint) -> String {
    match point.found.within_s {
        Some(seconds) if seconds < 1.0 => format!("{:.0} ms", 1e3 * seconds),
        Some(seconds) => format!("{seconds:.1} s"),
        None => format!("{} of {}", point.found.count, point.runs),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(size: f64, within_s: Option<f64>) -> LimitPoint {
        let reached = Reached { within_s, ..Reached::default() };
        LimitPoint { size, runs: 0, found: reached, right: reached }
    }

    #[test]
    fn a_time_is_that_of_nineteen_runs_in_twenty() {
        let of = |missed: usize| {
            let times = (0..20).map(|run| (run >= missed).then_some(run as u64));
            Reached::of(times.collect(), 1e-3)
        };
        let of = |missed| (of(missed).count, of(missed).within_s);
        assert_eq!(of(0), (20, Some(0.019)));
        assert_eq!(of(1), (19, Some(0.020)));
        assert_eq!(of(2), (18, None));
        assert_eq!(Reached::of(Vec::new(), 1e-3), Reached::default());
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
