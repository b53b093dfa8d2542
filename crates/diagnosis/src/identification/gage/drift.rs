//! The gage's offset grows steadily: a ramp from the onset on \[m/s\].

use vocabulary::fault::FaultKind;

use super::record::Record;
use super::scales::{OF_CONTROLLER, at_all};
use crate::identification::hypothesis::{Hypothesis, Weighing};

/// By its own noise in a hundred seconds, up to ten thousand times its noise in a second.
pub(super) const HYPOTHESIS: Hypothesis<Record> = Hypothesis {
    kind: FaultKind::Drift,
    prior: 1.0,
    weigh: |record| {
        let unit = record.own_noise_m2.sqrt();
        let cases = record.over_onsets(|onset, wandering| {
            let filter = record.follow(onset, wandering, |point| point.time_after_s(onset.at_s));
            [0.01, 1.0].iter().flat_map(|per_s| at_all(&filter, per_s * unit)).collect()
        });
        let age_s = cases.likeliest().map_or(0.0, |best| record.age_s(&best));
        Weighing::sized(&cases, |size| OF_CONTROLLER * size / age_s.max(1.0))
    },
    show: |record, best| {
        record.signature(best, |point, onset, level_m| {
            level_m + best.mean * point.time_after_s(onset.at_s)
        })
    },
};
