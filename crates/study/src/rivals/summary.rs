//! Limits at a common rate of false alarms, and what each detector finds with its own.

use std::collections::BTreeMap;

use serde::Serialize;
use statrs::distribution::{Binomial, DiscreteCDF};
use vocabulary::Step;
use vocabulary::fault::{Fault, FaultKind};

use super::{DetectorName, RivalRecord};
use crate::campaign::Rows;
use crate::group::Diagnosed;
use crate::report::{Table, interval, percent};
use crate::statistics::{Delays, Interval95, rate_interval, share_interval};

/// Version of the printed object.
const VERSION: u64 = 1;

/// The comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RivalSummary {
    /// Version of the format.
    pub v: u64,
    /// False alarms per hour that the limits are made for.
    pub per_hour: f64,
    /// Hours without a fault from which the limits follow.
    pub calibration_hours: f64,
    /// Hours without a fault in which false alarms are counted.
    pub test_hours: f64,
    /// Runs with a fault.
    pub faults: u64,
    /// One for each detector, and one for each kind of diagnoser with thresholds of its own.
    pub rows: Vec<RivalRow>,
}

/// What a detector came to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RivalRow {
    /// Its name.
    pub detector: &'static str,
    /// Whether its limit is that of the common rate of false alarms; otherwise it has thresholds of its own.
    pub at_common_rate: bool,
    /// False alarms per hour, in other runs than those from which the limit follows. A run has one at most.
    pub false_alarms_per_hour: f64,
    /// Its interval.
    pub false_alarms_per_hour_95: Interval95,
    /// Share of the faults after whose onset there was an alarm.
    pub found: f64,
    /// Its interval.
    pub found_95: Interval95,
    /// Share of the faults whose component the first alarm named, without an alarm before the onset.
    pub right: f64,
    /// Its interval.
    pub right_95: Interval95,
    /// Median time from the onset to the alarm, of those that are right \[ms\].
    pub median_delay_ms: Option<f64>,
    /// Faults that this detector names right and the first does not, and the other way round.
    pub better_and_worse: [u64; 2],
    /// Probability of a difference at least this large between equally good detectors (McNemar's test, exact); `None` for the
    /// first detector.
    pub p: Option<f64>,
    /// The same by kind of fault.
    pub kinds: BTreeMap<FaultKind, RivalKind>,
    /// The share of right ones against the size, ascending.
    pub curves: BTreeMap<SizedFaults, Vec<RivalPoint>>,
}

/// Faults that have sizes which can be compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SizedFaults {
    /// Leaks of all kinds; the leak coefficient \[m²\].
    Leak,
    /// Biases; the size of the offset \[m\].
    Bias,
    /// Random walks; the standard deviation of the increment in a step \[m\].
    RandomWalk,
}

impl SizedFaults {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Leak, Self::Bias, Self::RandomWalk];

    /// For people, with the unit of the size.
    #[must_use]
    pub fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::Leak => ("leak", "m²"),
            Self::Bias => ("bias", "m"),
            Self::RandomWalk => ("random walk", "m per step"),
        }
    }

    /// Which of them a fault is, and its size.
    fn of(fault: &Fault) -> Option<(Self, f64)> {
        match *fault {
            Fault::InternalLeakage { area_m2 }
            | Fault::ExternalLeakageA { area_m2 }
            | Fault::ExternalLeakageB { area_m2 } => Some((Self::Leak, area_m2)),
            Fault::Bias { offset_m } => Some((Self::Bias, offset_m.abs())),
            Fault::RandomWalk { increment_m, .. } => Some((Self::RandomWalk, increment_m)),
            _ => None,
        }
    }
}

/// Faults of similar sizes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RivalPoint {
    /// Their median size, see [`SizedFaults`].
    pub size: f64,
    /// Their number.
    pub faults: u64,
    /// The share of those whose component was named first.
    pub right: f64,
    /// Its interval.
    pub right_95: Interval95,
}

/// The curves have at most so many points, of at least so many faults.
const MOST_POINTS: usize = 6;
const LEAST_FAULTS: usize = 5;

/// The share of right ones among faults of similar sizes.
fn curves(
    faults: &[&RivalRecord],
    outcomes: &[RivalOutcome],
) -> BTreeMap<SizedFaults, Vec<RivalPoint>> {
    let mut sized = BTreeMap::<SizedFaults, Vec<(f64, bool)>>::new();
    for (run, outcome) in faults.iter().zip(outcomes) {
        let of = run.injection.as_ref().and_then(|fault| SizedFaults::of(&fault.fault));
        if let Some((kind, size)) = of {
            sized.entry(kind).or_default().push((size, outcome.right));
        }
    }
    let point = |faults: &[(f64, bool)]| {
        let right = faults.iter().filter(|(_, right)| *right).count() as u64;
        let (all, middle) = (faults.len() as u64, faults.get(faults.len() / 2));
        RivalPoint {
            size: middle.map_or(0.0, |(size, _)| *size),
            faults: all,
            right: right as f64 / all.max(1) as f64,
            right_95: share_interval(right, all),
        }
    };
    let curve = |mut faults: Vec<(f64, bool)>| {
        faults.sort_by(|a, b| a.0.total_cmp(&b.0));
        let points = (faults.len() / LEAST_FAULTS).clamp(1, MOST_POINTS);
        faults.chunks(faults.len().div_ceil(points).max(1)).map(point).collect()
    };
    sized.into_iter().map(|(kind, faults)| (kind, curve(faults))).collect()
}

/// What a detector came to with faults of a kind.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RivalKind {
    /// Faults.
    pub faults: u64,
    /// Those found.
    pub found: u64,
    /// Those whose component was named first.
    pub right: u64,
}

/// What a detector made of a fault.
#[derive(Debug, Clone, Copy, Default)]
struct RivalOutcome {
    found: bool,
    right: bool,
    delay: Option<u64>,
}

impl RivalSummary {
    pub(super) fn of(
        rows: &Rows<RivalRecord>,
        calibrates: impl Fn(u64) -> bool,
        per_hour: f64,
        hold_steps: u64,
        step_s: f64,
    ) -> Self {
        let hours = |steps: u64| steps as f64 * step_s / 3600.0;
        let select = |is_calibration: bool| {
            let nominal = rows.iter().filter(|(_, row)| row.injection.is_none());
            let chosen = nominal.filter(|(case, _)| calibrates(**case) == is_calibration);
            chosen.map(|(_, row)| row).collect::<Vec<_>>()
        };
        let (calibration, test) = (select(true), select(false));
        let watched = |runs: &[&RivalRecord]| hours(runs.iter().map(|run| run.watched).sum());
        let (calibration_hours, test_hours) = (watched(&calibration), watched(&test));
        let faults: Vec<&RivalRecord> =
            rows.values().filter(|row| row.injection.is_some()).collect();
        let allowed = (per_hour * calibration_hours).round() as usize;
        let detectors = DetectorName::ALL.iter().enumerate().map(|(place, name)| {
            let peak =
                |run: &&RivalRecord| run.courses.get(place).and_then(|course| course.healthy);
            let limit = match name {
                // No limit would keep it quiet.
                DetectorName::AlwaysAlarm => i32::MIN,
                _ => limit(calibration.iter().map(peak).collect(), allowed),
            };
            let outcome = |run: &&RivalRecord| common_outcome(run, place, limit, hold_steps);
            JudgedDetector {
                title: name.title(),
                at_common_rate: true,
                alarms: test.iter().filter(|run| peak(run) >= Some(limit)).count() as u64,
                outcomes: faults.iter().map(outcome).collect(),
            }
        });
        type Named = fn(&RivalRecord) -> &[Diagnosed];
        let own: [(&'static str, Named); 2] = [
            ("shipped diagnosers, own thresholds", |run| &run.shipped),
            ("the paper's diagnosers, own thresholds", |run| &run.paper),
        ];
        let own = own.into_iter().map(|(title, named)| JudgedDetector {
            title,
            at_common_rate: false,
            alarms: test.iter().filter(|run| !named(run).is_empty()).count() as u64,
            outcomes: faults.iter().map(|run| own_outcome(run, named(run))).collect(),
        });
        let judged: Vec<JudgedDetector> = detectors.chain(own).collect();
        let row = |(place, one): (usize, &JudgedDetector)| {
            let first = judged.first().filter(|_| place > 0);
            one.row(first, &faults, test_hours, step_s)
        };
        let rows = judged.iter().enumerate().map(row).collect();
        let faults = faults.len() as u64;
        Self { v: VERSION, per_hour, calibration_hours, test_hours, faults, rows }
    }

    pub(super) fn tables(&self) -> (Vec<Table>, Vec<String>) {
        let heading = [
            "detector",
            "false alarms/h",
            "95 %",
            "found",
            "right component",
            "95 %",
            "delay [ms]",
            "better",
            "worse",
            "p",
        ];
        let cells = |row: &RivalRow| {
            let Interval95(low, high) = row.false_alarms_per_hour_95;
            vec![
                row.detector.to_owned(),
                format!("{:.1}", row.false_alarms_per_hour),
                format!("{low:.1} to {high:.1}"),
                percent(row.found),
                percent(row.right),
                interval(row.right_95),
                row.median_delay_ms.map_or_else(|| "–".to_owned(), |delay| format!("{delay:.0}")),
                row.better_and_worse[0].to_string(),
                row.better_and_worse[1].to_string(),
                row.p.map_or_else(|| "–".to_owned(), |p| format!("{p:.2e}")),
            ]
        };
        let title = "Detectors at the same rate of false alarms";
        let detectors = Table::new(title, &heading, self.rows.iter().map(cells).collect());
        let kinds: Vec<FaultKind> =
            self.rows.first().map_or_else(Vec::new, |row| row.kinds.keys().copied().collect());
        let words: Vec<&str> = kinds.iter().map(|kind| kind.words()).collect();
        let of_kinds = |row: &RivalRow| {
            let of_kind = |kind: &FaultKind| {
                row.kinds
                    .get(kind)
                    .map_or_else(String::new, |of| format!("{}/{}", of.right, of.faults))
            };
            let counts = kinds.iter().map(of_kind);
            [row.detector.to_owned()].into_iter().chain(counts).collect()
        };
        let heading: Vec<&str> = ["detector"].into_iter().chain(words).collect();
        let by_kind = self.rows.iter().map(of_kinds).collect();
        let by_kind = Table::new("Right component, by kind of fault", &heading, by_kind);
        let note = format!(
            "{} faults; limits for {} false alarms per hour from {:.2} h without a fault, counted in other {:.2} h. Better, \
             worse: faults that the detector names right and the shipped divergence does not, and the other way round; p: \
             McNemar's test.",
            self.faults, self.per_hour, self.calibration_hours, self.test_hours
        );
        (vec![detectors, by_kind], vec![note])
    }
}

/// The lowest level that no more than the allowed number of runs reach.
fn limit(mut peaks: Vec<Option<i32>>, allowed: usize) -> i32 {
    peaks.sort_unstable_by(|a, b| b.cmp(a));
    peaks.get(allowed).copied().flatten().map_or(i32::MIN, |level| level.saturating_add(1))
}

/// What the detector of this place makes of a fault at this limit.
fn common_outcome(run: &RivalRecord, place: usize, limit: i32, hold_steps: u64) -> RivalOutcome {
    let Some(course) = run.courses.get(place) else { return RivalOutcome::default() };
    let alarm = course.alarm(limit, hold_steps);
    let is_early = course.healthy >= Some(limit);
    let named = alarm.filter(|(_, place)| !is_early && run.faulty == Some(*place));
    RivalOutcome {
        found: alarm.is_some(),
        right: named.is_some(),
        delay: named.map(|(delay, _)| delay),
    }
}

/// What diagnosers with thresholds of their own made of a fault.
fn own_outcome(run: &RivalRecord, diagnosed: &[Diagnosed]) -> RivalOutcome {
    let Some(fault) = &run.injection else { return RivalOutcome::default() };
    let onset: Step = fault.at;
    let after = diagnosed.iter().find(|diagnosed| diagnosed.detection >= onset);
    let is_early = diagnosed.iter().any(|diagnosed| diagnosed.detection < onset);
    let named = after.filter(|one| one.component == fault.component && !is_early);
    RivalOutcome {
        found: after.is_some(),
        right: named.is_some(),
        delay: named.map(|named| named.detection.since(onset)),
    }
}

/// What a detector came to in all runs.
struct JudgedDetector {
    title: &'static str,
    at_common_rate: bool,
    /// Fault-free runs with an alarm.
    alarms: u64,
    /// One for each fault.
    outcomes: Vec<RivalOutcome>,
}

impl JudgedDetector {
    /// Its row, compared with the first detector.
    fn row(
        &self,
        first: Option<&Self>,
        faults: &[&RivalRecord],
        test_hours: f64,
        step_s: f64,
    ) -> RivalRow {
        let Self { title, at_common_rate, alarms, outcomes } = self;
        let count =
            |of: fn(&RivalOutcome) -> bool| outcomes.iter().filter(|one| of(one)).count() as u64;
        let (found, right) = (count(|one| one.found), count(|one| one.right));
        let all = outcomes.len() as u64;
        let share = |part: u64| part as f64 / all.max(1) as f64;
        let pairs = || outcomes.iter().zip(first.map_or(&outcomes[..], |first| &first.outcomes));
        let differ = |right: bool| {
            pairs().filter(|(one, first)| one.right == right && first.right != right).count() as u64
        };
        let discordant = [differ(true), differ(false)];
        let per_test_hour = |alarms: f64| alarms / test_hours.max(f64::MIN_POSITIVE);
        let Interval95(low, high) = rate_interval(*alarms);
        let mut kinds = BTreeMap::<FaultKind, RivalKind>::new();
        for (run, outcome) in faults.iter().zip(outcomes) {
            let Some(fault) = &run.injection else { continue };
            let kind = kinds.entry(fault.fault.kind());
            let kind = kind.or_insert(RivalKind { faults: 0, found: 0, right: 0 });
            kind.faults += 1;
            kind.found += u64::from(outcome.found);
            kind.right += u64::from(outcome.right);
        }
        let delays = Delays::of(outcomes.iter().filter_map(|one| one.delay), step_s);
        RivalRow {
            detector: title,
            at_common_rate: *at_common_rate,
            false_alarms_per_hour: per_test_hour(*alarms as f64),
            false_alarms_per_hour_95: Interval95(per_test_hour(low), per_test_hour(high)),
            found: share(found),
            found_95: share_interval(found, all),
            right: share(right),
            right_95: share_interval(right, all),
            median_delay_ms: delays.median,
            better_and_worse: discordant,
            p: first.map(|_| mcnemar(discordant)),
            kinds,
            curves: curves(faults, outcomes),
        }
    }
}

/// Probability that so uneven a split of the pairs that differ comes from even chances (McNemar 1947, exact, two-sided).
fn mcnemar([better, worse]: [u64; 2]) -> f64 {
    let binomial = Binomial::new(0.5, better + worse);
    binomial.map_or(1.0, |binomial| (2.0 * binomial.cdf(better.min(worse))).min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_let_as_many_runs_alarm_as_allowed() {
        let peaks = vec![Some(3), None, Some(9), Some(5)];
        assert_eq!(limit(peaks.clone(), 0), 10);
        assert_eq!(limit(peaks.clone(), 1), 6);
        assert_eq!(limit(peaks.clone(), 3), i32::MIN);
        assert_eq!(limit(Vec::new(), 0), i32::MIN);
    }

    /// `scipy.stats.binomtest(min, n).pvalue`, SciPy 1.17.1.
    #[test]
    fn pairs_are_tested_as_in_scipy() {
        for (pairs, p) in [([0, 0], 1.0), ([0, 5], 0.0625), ([2, 10], 0.03857421875), ([7, 8], 1.0)]
        {
            assert!((mcnemar(pairs) - p).abs() < 1e-12, "{pairs:?}");
        }
    }
}
