//! The gage repeats its last reading.

use vocabulary::fault::FaultKind;

use super::record::{Onset, Record};
use crate::identification::hypothesis::{Hypothesis, Weighing};
use crate::identification::level::{Weighed, deviance};

/// What a repeated reading may differ by, in standard deviations of the gage's noise: what a converter makes of it.
const REPEATS_WITHIN: f64 = 0.01;

pub(super) const HYPOTHESIS: Hypothesis<Record> = Hypothesis {
    kind: FaultKind::Stuck,
    prior: 1.0,
    weigh: |record| {
        let cases = record.over_onsets(|onset, wandering| {
            let log_likelihood =
                wandering.before(onset).log_likelihood() - 0.5 * held(record, onset);
            vec![Weighed { log_likelihood, mean: 0.0, variance: 0.0, place: 0 }]
        });
        Weighing::without_size(&cases)
    },
    show: |record, best| {
        record.signature(best, |point, onset, _| {
            point.off_m - point.reading_m + record.points[onset.first].reading_m
        })
    },
};

/// Deviance of readings that repeat the last good one: the first of them, or the one before.
fn held(record: &Record, onset: &Onset) -> f64 {
    let variance = REPEATS_WITHIN * REPEATS_WITHIN * record.own_noise_m2;
    let first = record.points[onset.first].reading_m;
    let before = record.points[onset.first.saturating_sub(1)].reading_m;
    let repeats = (first - before).abs() <= variance.sqrt();
    let held = if repeats { before } else { first };
    let points = &record.points[onset.first..];
    points.iter().map(|point| deviance(point.reading_m - held, variance)).sum()
}
