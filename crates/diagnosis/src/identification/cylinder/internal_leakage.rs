//! Oil leaks from chamber A into chamber B (eq. 10): what A lacks, B has too much; the coefficient \[m²\].

use vocabulary::fault::FaultKind;

use super::record::{FIGURES, Record};
use crate::identification::hypothesis::{Hypothesis, Weighing};
use crate::identification::level::Prior;

pub(super) const HYPOTHESIS: Hypothesis<Record> = Hypothesis {
    kind: FaultKind::InternalLeakage,
    prior: 1.0,
    weigh: |record| leak(record, |[across, _, _]| [-across, across]),
    show: |record, best| record.signature(best, 0, |sums| -sums.leaks[0]),
};

/// Coefficients \[m²\]: any order of magnitude is as likely as any other.
const AREAS_M2: [f64; 5] = [1e-9, 1e-8, 1e-7, 1e-6, 1e-5];

/// A leak whose hole of one square metre lets this into A and into B, given what flows through each of the three.
pub(super) fn leak(record: &Record, into: impl Fn([f64; 3]) -> [f64; 2]) -> Weighing {
    let priors = AREAS_M2.map(Prior::about_zero);
    let cases = record.over_onsets(|first| {
        let mut weighed = record.weigh(&record.since(first, |sums| into(sums.leaks)), &priors);
        // A leak lets oil out; what would have to let it in is none.
        for case in &mut weighed {
            if case.mean <= 0.0 {
                case.log_likelihood = f64::NEG_INFINITY;
            }
        }
        weighed
    });
    // What makes up for the leak is known as well as the valve.
    Weighing::sized(&cases, |leak| FIGURES.deviation * leak)
}
