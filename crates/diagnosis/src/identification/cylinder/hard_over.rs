//! The inlet of chamber A is fully open, whatever is commanded.

use vocabulary::fault::FaultKind;

use super::record::Record;
use crate::identification::hypothesis::{Hypothesis, Weighing};
use crate::identification::level::Prior;

/// As far open as its figures say, within a tenth.
const OPEN: Prior = Prior { mean: 1.0, deviation: 0.05 };

pub(super) const HYPOTHESIS: Hypothesis<Record> = Hypothesis {
    kind: FaultKind::HardOver,
    prior: 1.0,
    weigh: |record| {
        let cases = record.over_onsets(|first| {
            let level = record.since(first, |sums| [sums.wide_open, 0.0]);
            record.weigh_valve(&level, OPEN).into_iter().collect()
        });
        Weighing::without_size(&cases)
    },
    show: |record, best| record.signature(best, 0, |sums| sums.wide_open),
};
