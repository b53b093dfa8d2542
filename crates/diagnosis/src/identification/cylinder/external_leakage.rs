//! A chamber leaks to the outside (eq. 11): it lacks what the other has not; the coefficient \[m²\].

use vocabulary::fault::FaultKind;

use super::internal_leakage::leak;
use super::record::Record;
use crate::identification::hypothesis::Hypothesis;

pub(super) const OF_A: Hypothesis<Record> = Hypothesis {
    kind: FaultKind::ExternalLeakageA,
    prior: 1.0,
    weigh: |record| leak(record, |[_, of_a, _]| [-of_a, 0.0]),
    show: |record, best| record.signature(best, 0, |sums| -sums.leaks[1]),
};

pub(super) const OF_B: Hypothesis<Record> = Hypothesis {
    kind: FaultKind::ExternalLeakageB,
    prior: 1.0,
    weigh: |record| leak(record, |[_, _, of_b]| [0.0, -of_b]),
    show: |record, best| record.signature(best, 1, |sums| -sums.leaks[2]),
};
