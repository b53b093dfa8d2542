//! The gage reads zero, noise apart, whatever the others say.

use vocabulary::fault::FaultKind;

use super::record::Record;
use crate::identification::hypothesis::{Hypothesis, Weighing};
use crate::identification::level::Weighed;

pub(super) const HYPOTHESIS: Hypothesis<Record> = Hypothesis {
    kind: FaultKind::ZeroOutput,
    prior: 1.0,
    weigh: |record| {
        let deviances = record.own_deviances(|point| point.reading_m);
        let cases = record.over_onsets(|onset, wandering| {
            let before = wandering.before(onset).log_likelihood();
            let log_likelihood = before - 0.5 * deviances[onset.first];
            vec![Weighed { log_likelihood, mean: 0.0, variance: 0.0, place: 0 }]
        });
        Weighing::without_size(&cases)
    },
    show: |record, best| record.signature(best, |point, _, _| point.off_m - point.reading_m),
};
