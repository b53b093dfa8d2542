//! The gage reads a constant amount too much: a step at the onset \[m\].

use vocabulary::fault::FaultKind;

use super::record::Record;
use super::scales::{OF_CONTROLLER, at_all};
use crate::identification::hypothesis::{Hypothesis, Weighing};

/// From its own noise to ten thousand times that.
pub(super) const HYPOTHESIS: Hypothesis<Record> = Hypothesis {
    kind: FaultKind::Bias,
    prior: 1.0,
    weigh: |record| {
        let unit = record.own_noise_m2.sqrt();
        let cases = record.over_onsets(|onset, wandering| {
            at_all(&record.follow(onset, wandering, |point| point.share_after(onset.at_s)), unit)
        });
        Weighing::sized(&cases, |size| OF_CONTROLLER * size)
    },
    show: |record, best| {
        record.signature(best, |point, onset, level_m| {
            level_m + best.mean * point.share_after(onset.at_s)
        })
    },
};
