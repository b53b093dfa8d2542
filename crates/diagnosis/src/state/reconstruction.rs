//! What a gage should read, as far as it follows from what is measured beside it.
//!
//! r̂ = c + w·x, for the residual r of a gage: x are the residuals of the module's other healthy gages and the forces,
//! the module's own and those of its peers that are heard. w = (S_xx + ρN)⁻¹ S_xr and c = μ_r − w·μ_x, with mean μ and
//! covariance S of the reference's short windows and the variances N of the noise, which windows even out and samples do
//! not (ridge regression; Hoerl and Kennard, Technometrics 12, 1970).
//!
//! If r and x are known of before the onset, as r₀ and x₀, then r̂ = r₀ + w·(x̄ − x₀) + v·(x − x̄) with slow means x̄: what
//! moves about them follows better from how values move within snippets, by which v is computed, than from how snippets
//! differ, and the other way round for what has changed slowly.

use serde::{Deserialize, Serialize};

use super::commissioning::FOLDS;
use super::gaussian::{Gaussian, SnippetValues};
use crate::settings::ModuleSetup;

/// ρ where values tell the level: weather that the reference does not know moves them as well.
pub(crate) const LEVEL_RIDGE: f64 = 3.0;
/// ρ where they tell what has changed: their noise is all that is to be expected.
pub(crate) const CHANGE_RIDGE: f64 = 1.0;
/// Short windows of each snippet from which the offset is held: two seconds, as in service.
const HELD_FROM: usize = 20;
/// No reconstruction is better \[m\]: it could not be resolved.
const LEAST_ERROR_M: f64 = 1e-9;

/// The noise of the values that a gage is reconstructed from.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct ReconstructionNoise {
    /// Variance of each of the module's own gages \[m²\].
    pub(crate) gages_m2: Vec<f64>,
    /// Variance of a force \[N²\].
    force_n2: f64,
}

impl ReconstructionNoise {
    pub(crate) fn of(setup: &ModuleSetup) -> Self {
        let scatters = setup.prior_scatters();
        let (forces, gages) = scatters.split_at(setup.actuators().min(scatters.len()));
        Self { gages_m2: gages.to_vec(), force_n2: forces.first().copied().unwrap_or_default() }
    }

    /// Variance of the value at this place of the reference, a gage of the module's own or a force.
    fn variance(&self, place: usize) -> f64 {
        self.gages_m2.get(place).copied().unwrap_or(self.force_n2)
    }
}

/// How the residual of a gage follows from other values of the reference.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Reconstruction {
    constant_m: f64,
    /// Where each value stands in the reference, and its weight.
    weights: Vec<(usize, f64)>,
    /// Standard deviation by the Gaussian alone \[m\].
    pub(crate) deviation_m: f64,
}

impl Reconstruction {
    /// How the value at place `own` follows from those at the places `from`, by their Gaussian and ρ.
    pub(crate) fn new(
        (means, ridge): (&Gaussian, f64),
        own: usize,
        from: &[usize],
        noise: &ReconstructionNoise,
    ) -> Option<Self> {
        let places: Vec<usize> = std::iter::once(own).chain(from.iter().copied()).collect();
        let ridge = |place| ridge * noise.variance(place);
        let (off, deviation_m) = means.regression_on_noisy(&places, 0, ridge)?;
        let weights: Vec<(usize, f64)> =
            places.into_iter().zip(off).skip(1).map(|(place, weight)| (place, -weight)).collect();
        let of_means: f64 = weights.iter().map(|(place, weight)| weight * means.mean[*place]).sum();
        Some(Self { constant_m: means.mean[own] - of_means, weights, deviation_m })
    }

    /// c + w·x \[m\]; NaN if a value is missing.
    pub(crate) fn residual_m(&self, value: impl Fn(usize) -> f64) -> f64 {
        self.weights
            .iter()
            .fold(self.constant_m, |sum, (place, weight)| sum + weight * value(*place))
    }

    /// The places in the reference of the values that it follows from.
    pub(crate) fn places(&self) -> impl Iterator<Item = usize> {
        self.weights.iter().map(|(place, _)| *place)
    }

    /// Variance of the residual due to the noise of the values \[m²\].
    pub(crate) fn noise_m2(&self, noise: &ReconstructionNoise) -> f64 {
        self.weights.iter().map(|(place, weight)| weight * weight * noise.variance(*place)).sum()
    }
}

/// Root mean square error of a gage's reconstruction in snippets that were left out \[m\].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReconstructionError {
    /// From the module's own values.
    pub alone_m: f64,
    /// The same with the offset of the first two seconds held.
    pub alone_held_m: f64,
    /// From the module's own values and its peers' forces.
    pub with_peers_m: f64,
    /// The same with the offset of the first two seconds held.
    pub with_peers_held_m: f64,
}

/// The errors of a module's own gages. `from` are the places of the module's own forces, and of all.
pub(super) fn errors(
    observations: &[SnippetValues<'_>],
    least: &[f64],
    gages: usize,
    [own_forces, all_forces]: [&[usize]; 2],
    noise: &ReconstructionNoise,
) -> Option<Vec<ReconstructionError>> {
    let mut sums = vec![[[0.0; 2]; 4]; gages];
    for fold in 0..FOLDS {
        let is_out = |one: &&SnippetValues| one.snippet % FOLDS == fold;
        let rest: Vec<_> = observations.iter().filter(|one| !is_out(one)).copied().collect();
        let left_out: Vec<_> = observations.iter().filter(is_out).copied().collect();
        let means = Gaussian::learn(&rest, least);
        let moving = Gaussian::learn_moving(&rest, least);
        for (gage, sums) in sums.iter_mut().enumerate() {
            let others = (0..gages).filter(|other| *other != gage);
            for (number, forces) in [own_forces, all_forces].into_iter().enumerate() {
                let from: Vec<usize> = others.clone().chain(forces.iter().copied()).collect();
                let [plain, held] = [(&means, LEVEL_RIDGE), (&moving, CHANGE_RIDGE)]
                    .map(|by| Reconstruction::new(by, gage, &from, noise));
                let (plain, held) = (plain?, held?);
                let off = |known: &Reconstruction, one: &SnippetValues| {
                    one.values[gage] - known.residual_m(|place| one.values[place])
                };
                for windows in left_out.chunk_by(|a, b| a.snippet == b.snippet) {
                    let of_held: Vec<f64> = windows.iter().map(|one| off(&held, one)).collect();
                    let (first, later) = of_held.split_at(HELD_FROM.min(of_held.len()));
                    let offset = first.iter().sum::<f64>() / first.len() as f64;
                    let mut add = |place: usize, value: f64| {
                        sums[place][0] += value * value;
                        sums[place][1] += 1.0;
                    };
                    windows.iter().for_each(|one| add(2 * number, off(&plain, one)));
                    later.iter().for_each(|value| add(2 * number + 1, value - offset));
                }
            }
        }
    }
    let error = |[plain, held]: [[f64; 2]; 2]| {
        let rms = |[squares, count]: [f64; 2]| (squares / f64::max(count, 1.0)).sqrt();
        // Snippets may be too short to hold anything.
        let held = if held[1] > 0.0 { held } else { plain };
        [plain, held].map(|sums| rms(sums).max(LEAST_ERROR_M))
    };
    let error = |[plain, held, with_peers, with_peers_held]: [[f64; 2]; 4]| {
        let [alone_m, alone_held_m] = error([plain, held]);
        let [with_peers_m, with_peers_held_m] = error([with_peers, with_peers_held]);
        ReconstructionError { alone_m, alone_held_m, with_peers_m, with_peers_held_m }
    };
    Some(sums.into_iter().map(error).collect())
}
