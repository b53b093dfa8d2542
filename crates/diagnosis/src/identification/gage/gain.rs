//! The gage reads a multiple of what it should: what it is off is a share of what the others say that it should read.
//! A part of the structure that has become softer shows in the same way, as a gain above one.

use vocabulary::fault::FaultKind;

use super::record::Record;
use crate::identification::hypothesis::{Hypothesis, Weighing};
use crate::identification::level::{Prior, Weighed};

/// By how much the gain may differ from one: normal, each as likely as the others.
const DEVIATIONS: [f64; 4] = [0.03, 0.1, 0.3, 1.0];

/// By how much what it should read may be wrong, as a share.
const OF_EXPECTED: f64 = 0.01;

pub(super) const HYPOTHESIS: Hypothesis<Record> = Hypothesis {
    kind: FaultKind::Gain,
    prior: 1.0,
    weigh: |record| {
        let cases = record.over_onsets(|onset, wandering| {
            // It read so much more than the others say before.
            let (before_m, _) = wandering.before(onset).level();
            let filter = record.follow(onset, wandering, |point| {
                (point.expected_m + before_m) * point.share_after(onset.at_s)
            });
            let weighed = DEVIATIONS.iter().filter_map(|d| filter.weigh(&[Prior::about_zero(*d)]));
            weighed.map(|case| Weighed { mean: 1.0 + case.mean, ..case }).collect()
        });
        Weighing::sized(&cases, |gain| OF_EXPECTED * (gain - 1.0))
    },
    show: |record, best| {
        record.signature(best, |point, onset, level_m| {
            let healthy_m = point.expected_m + level_m;
            level_m + (best.mean - 1.0) * healthy_m * point.share_after(onset.at_s)
        })
    },
};
