//! The gage's offset wanders: from the onset on each step adds a normal increment \[m per step\].

use names::fault::FaultKind;

use super::record::{Onset, Record};
use crate::identification::hypothesis::{Hypothesis, Weighing};
use crate::identification::level::Weighed;

/// Standard deviation of the increment, in standard deviations of the gage's noise; each as likely as the others.
const INCREMENTS: [f64; 9] = [0.03, 0.06, 0.12, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0];
/// Of the logarithm of an increment between two of these, as a share.
const BETWEEN: f64 = 0.2;

pub(super) const HYPOTHESIS: Hypothesis<Record> = Hypothesis {
    kind: FaultKind::RandomWalk,
    prior: 1.0,
    weigh: |record| {
        let unit = record.own_noise_m2.sqrt();
        let cases = record.over_onsets(|onset| {
            INCREMENTS.iter().map(|increment| wandering(record, onset, increment * unit)).collect()
        });
        Weighing { cases, has_size: true }
    },
};

fn wandering(record: &Record, onset: &Onset, increment_m: f64) -> Weighed {
    let mut level = record.before(onset).clone();
    let per_s = increment_m * increment_m / record.step_s;
    for (place, point) in record.points.iter().enumerate().skip(onset.first) {
        let walked = per_s * record.since_s(place).max(record.step_s);
        level.take(point.off_m, walked, record.noise_m2 / point.count, []);
    }
    let log_likelihood = level.log_likelihood();
    Weighed { log_likelihood, mean: increment_m, variance: (BETWEEN * increment_m).powi(2) }
}
