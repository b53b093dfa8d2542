//! How large a displacement may be beforehand: any order of magnitude is as likely as any other.

use crate::identification::level::{Level, Prior, Weighed, deviance};

/// By how much a size may be wrong beyond what noise and wandering make of it, as a share of it: the controller moves the
/// structure by what a faulty gage reads, and how the others follow that is known from the model and the strokes, within a
/// tenth. From seeds of their own, see the study's `IDENTIFICATION.md`.
pub(super) const OF_CONTROLLER: f64 = 0.0017;
/// Orders of magnitude: normal priors about zero with these deviations, times a unit, each as likely as the others.
const SCALES: [f64; 9] = [1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1e3, 3e3, 1e4];

/// What a filter says of its coefficient at each scale.
pub(super) fn at_all(filter: &Level<1>, unit: f64) -> Vec<Weighed> {
    SCALES.iter().filter_map(|scale| filter.weigh(&[Prior::about_zero(scale * unit)])).collect()
}

/// Logarithm of the density of a coefficient beforehand.
pub(super) fn log_density(coefficient: f64, unit: f64) -> f64 {
    let of_scale = |scale: &f64| {
        let variance = (scale * unit).powi(2);
        (-0.5 * deviance(coefficient, variance)).exp()
    };
    (SCALES.iter().map(of_scale).sum::<f64>() / SCALES.len() as f64).ln()
}
