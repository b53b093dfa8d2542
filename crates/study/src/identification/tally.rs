//! Results of many cases: confusion of kinds, coverage of sizes, undecided faults.

use std::collections::BTreeMap;

use serde::Serialize;
use vocabulary::IdentifiedKind;

use super::row::IdentificationRow;
use crate::campaign::{Rows, grouped};
use crate::conditions::Situation;
use crate::statistics::{Interval95, nearest_rank, share_interval};

/// Claims are about faults from this multiple of the limit of their kind on.
const CLAIMED_IN_LIMITS: f64 = 2.0;
/// Ends of the ranges of sizes, in limits of their kind, that undecided faults are counted in.
pub const SIZES_IN_LIMITS: [f64; 8] = [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0];

/// Time after which identifications are final, since the component was declared faulty \[s\].
const IN_THE_END_S: f64 = f64::INFINITY;

/// The stated kinds of faults of one true kind.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct KindRow {
    /// The number of faults.
    pub cases: u64,
    /// Their component was not declared faulty.
    pub not_named: u64,
    /// Faults whose kind was not decided.
    pub undecided: u64,
    /// The decided kinds.
    pub decided: BTreeMap<IdentifiedKind, u64>,
}

impl KindRow {
    fn of(records: &[&IdentificationRow], until_s: f64) -> Self {
        let mut row = Self { cases: records.len() as u64, ..Self::default() };
        for record in records {
            *match record.decided_within(until_s) {
                Some(kind) => row.decided.entry(kind).or_default(),
                None if record.named_after_s.is_none() => &mut row.not_named,
                None => &mut row.undecided,
            } += 1;
        }
        row
    }
}

/// Stated sizes of one kind compared with the true ones, for correctly decided faults.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sizing {
    /// The number of stated sizes.
    pub stated: u64,
    /// The number of 95 % intervals that contain the true size.
    pub covered: u64,
    /// Interval of that share.
    pub covered_95: Interval95,
    /// The number of intervals below the true size, and above it, in magnitude.
    pub below: u64,
    /// See `below`.
    pub above: u64,
    /// Median of the relative error's magnitude.
    pub median_error: f64,
}

/// The results for faults in one situation.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct SituationRow {
    /// Faults whose component was declared faulty.
    pub named: u64,
    /// Faults, among these, whose kind was decided within a second.
    pub decided: u64,
    /// Faults, among these, whose decided kind is right.
    pub right: u64,
    /// Like `decided`, at the end.
    pub decided_in_the_end: u64,
    /// Like `right`, at the end.
    pub right_in_the_end: u64,
}

/// Faults of one range of sizes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct UndecidedBySize {
    /// The range, in limits of the kind.
    pub from: f64,
    /// Its end.
    pub to: f64,
    /// Faults whose component was declared faulty.
    pub named: u64,
    /// Faults, among these, whose kind was undecided at each of [`UNDECIDED_AFTER_S`].
    pub undecided: [u64; 3],
}

/// Times at which undecided faults are counted, since their component was declared faulty \[s\].
pub const UNDECIDED_AFTER_S: [f64; 3] = [0.2, 1.0, 10.0];

/// Faults of all kinds from twice the limit of their kind on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Right {
    /// Those that were decided within a second.
    pub decided: u64,
    /// Of these, those that are of this kind.
    pub right: u64,
    /// Interval of that share.
    pub right_95: Interval95,
}

/// The results of a campaign.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IdentificationSummary {
    /// All faults.
    pub all: Right,
    /// By kind, a second after they were named; from twice the limit on.
    pub within_a_second: BTreeMap<IdentifiedKind, KindRow>,
    /// By kind, at the end; from twice the limit on.
    pub in_the_end: BTreeMap<IdentifiedKind, KindRow>,
    /// Stated sizes by kind, a second after they were named; of every size.
    pub sizes_within_a_second: BTreeMap<IdentifiedKind, Sizing>,
    /// The same at the end.
    pub sizes_in_the_end: BTreeMap<IdentifiedKind, Sizing>,
    /// By situation; from twice the limit on.
    pub situations: BTreeMap<Situation, SituationRow>,
    /// By kind and size.
    pub undecided: BTreeMap<IdentifiedKind, Vec<UndecidedBySize>>,
}

impl IdentificationSummary {
    /// Counts cases.
    #[must_use]
    pub fn of(rows: &Rows<IdentificationRow>) -> Self {
        let is_claimed =
            |row: &&IdentificationRow| row.in_limits.is_none_or(|size| size >= CLAIMED_IN_LIMITS);
        let claimed: Vec<&IdentificationRow> = rows.values().filter(is_claimed).collect();
        let (kinds, claimed_kinds) = (
            grouped(rows.values(), |row| row.kind),
            grouped(claimed.iter().copied(), |row| row.kind),
        );
        let confusion = |until_s| {
            let row =
                |(kind, rows): (&IdentifiedKind, &Vec<_>)| (*kind, KindRow::of(rows, until_s));
            claimed_kinds.iter().map(row).collect::<BTreeMap<_, _>>()
        };
        let sizes = |until_s| {
            let row = |(kind, rows): (&IdentifiedKind, &Vec<_>)| {
                Some((*kind, Sizing::of(rows, until_s)?))
            };
            kinds.iter().filter_map(row).collect()
        };
        let is_sized = |row: &&IdentificationRow| row.named_after_s.and(row.in_limits).is_some();
        let sized = grouped(rows.values().filter(is_sized), |row| row.kind);
        let undecided = |(kind, rows): (&IdentifiedKind, &Vec<_>)| (*kind, undecided(rows));
        let situations = grouped(claimed.iter().copied(), |row| row.situation);
        let [decided, right] = decided_and_right(&claimed, 1.0);
        Self {
            all: Right { decided, right, right_95: share_interval(right, decided) },
            within_a_second: confusion(1.0),
            in_the_end: confusion(IN_THE_END_S),
            sizes_within_a_second: sizes(1.0),
            sizes_in_the_end: sizes(IN_THE_END_S),
            situations: situations.iter().map(|(of, rows)| (*of, SituationRow::of(rows))).collect(),
            undecided: sized.iter().map(undecided).collect(),
        }
    }
}

/// The number of faults decided within a time, and of those decided correctly.
fn decided_and_right(records: &[&IdentificationRow], until_s: f64) -> [u64; 2] {
    let decided = records.iter().filter_map(|row| Some((row.decided_within(until_s)?, row.kind)));
    let right = decided.clone().filter(|(decided, kind)| decided == kind);
    [decided.count() as u64, right.count() as u64]
}

impl SituationRow {
    fn of(records: &[&IdentificationRow]) -> Self {
        let [decided, right] = decided_and_right(records, 1.0);
        let [decided_in_the_end, right_in_the_end] = decided_and_right(records, IN_THE_END_S);
        let named = records.iter().filter(|row| row.named_after_s.is_some()).count() as u64;
        Self { named, decided, right, decided_in_the_end, right_in_the_end }
    }
}

impl Sizing {
    /// The results for faults of one kind; `None` if no size was stated.
    fn of(records: &[&IdentificationRow], until_s: f64) -> Option<Self> {
        let size = |row: &&IdentificationRow| {
            row.decided_within(until_s).filter(|kind| *kind == row.kind)?;
            Some((row.size?, row.within(until_s)?.size?))
        };
        let sizes: Vec<(f64, [f64; 3])> = records.iter().filter_map(size).collect();
        // A size and its mirror image have the same error.
        let ends = |(truth, [low, _, high]): &(f64, [f64; 3])| match *truth < 0.0 {
            true => (-truth, -high, -low),
            false => (*truth, *low, *high),
        };
        let count = |of: fn((f64, f64, f64)) -> bool| {
            sizes.iter().map(ends).filter(|size| of(*size)).count() as u64
        };
        let (stated, below) = (sizes.len() as u64, count(|(truth, _, high)| high < truth));
        let above = count(|(truth, low, _)| low > truth);
        let covered = stated - below - above;
        let mut errors: Vec<f64> =
            sizes.iter().map(|(truth, [_, value, _])| (value / truth - 1.0).abs()).collect();
        errors.sort_by(f64::total_cmp);
        Some(Self {
            stated,
            covered,
            covered_95: share_interval(covered, stated),
            below,
            above,
            median_error: nearest_rank(&errors, 0.5)?,
        })
    }
}

/// Faults of one kind that have a size and were named, by their size.
fn undecided(records: &[&IdentificationRow]) -> Vec<UndecidedBySize> {
    let ranges = SIZES_IN_LIMITS.windows(2);
    let mut ranges: Vec<UndecidedBySize> = ranges
        .map(|ends| UndecidedBySize { from: ends[0], to: ends[1], named: 0, undecided: [0; 3] })
        .collect();
    for record in records {
        let Some(size) = record.in_limits else { continue };
        let Some(row) = ranges.iter_mut().find(|row| size < row.to) else { continue };
        row.named += 1;
        for (count, when) in row.undecided.iter_mut().zip(UNDECIDED_AFTER_S) {
            *count += u64::from(record.decided_within(when).is_none());
        }
    }
    ranges
}

#[cfg(test)]
mod tests {
    use vocabulary::fault::FaultKind;

    use super::super::row::IdentificationStatement;
    use super::*;

    fn record(
        kind: FaultKind,
        in_limits: f64,
        words: Vec<IdentificationStatement>,
    ) -> IdentificationRow {
        IdentificationRow {
            situation: Situation::Alone,
            component: "m/sensor/g".parse().unwrap(),
            fault: String::new(),
            kind: kind.into(),
            size: Some(-10.0),
            in_limits: Some(in_limits),
            named_after_s: Some(0.01),
            words,
        }
    }

    fn word(
        after_s: f64,
        kind: FaultKind,
        probability: f64,
        size: [f64; 3],
    ) -> IdentificationStatement {
        IdentificationStatement {
            after_s,
            kinds: vec![(kind.into(), probability)],
            size: Some(size),
        }
    }

    #[test]
    fn words_count_until_their_time_and_faults_from_twice_their_limit_on() {
        let bias = FaultKind::Bias;
        let records = [
            record(
                bias,
                3.0,
                vec![word(0.02, bias, 0.6, [0.0; 3]), word(0.9, bias, 0.96, [-11.0, -10.1, -9.0])],
            ),
            record(
                bias,
                3.0,
                vec![
                    word(0.02, FaultKind::Drift, 0.99, [0.0; 3]),
                    word(2.0, bias, 1.0, [-9.0, -8.0, -7.0]),
                ],
            ),
            record(bias, 1.5, vec![word(0.02, FaultKind::Gain, 0.99, [0.0; 3])]),
        ];
        let rows = (0..).zip(records).collect();
        let tally = IdentificationSummary::of(&rows);
        assert_eq!((tally.all.decided, tally.all.right), (2, 1));
        let bias = IdentifiedKind::Known(bias);
        let row = &tally.in_the_end[&bias];
        assert_eq!((row.cases, row.undecided, &row.decided), (2, 0, &BTreeMap::from([(bias, 2)])));
        let sizing = &tally.sizes_in_the_end[&bias];
        assert_eq!((sizing.stated, sizing.covered, sizing.below, sizing.above), (2, 1, 1, 0));
        let of_three = tally.undecided[&bias].iter().find(|row| row.to > 3.0).unwrap();
        assert_eq!((of_three.named, of_three.undecided), (2, [1, 0, 0]));
    }
}
