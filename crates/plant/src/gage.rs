//! Strain gages with noise and their faults (section 3.3 of the paper).
//!
//! y = k ζ + b + ε (eq. 12), ζ the elongation of the gage's member and ε normal noise. Healthy:
//! k = 1, b = 0. Bias: b constant. Random walk: b_{j+1} = b_j + δ_j from b = 0, with δ normal; the
//! first increment is in the first faulty sample. Zero output: k = 0, the noise remains. No signal: the reading is
//! not a number.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use crate::check::Checks;
use crate::streams::Stream;

/// The gages: all alike. Marks: \[E\] engineering estimate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GageParameters {
    /// Standard deviation of the noise as strain \[–\]: 0.3e-6; 0.9 µm on a member of 3 m \[E\].
    pub noise_strain: f64,
}

impl Default for GageParameters {
    fn default() -> Self {
        Self { noise_strain: 0.3e-6 }
    }
}

impl GageParameters {
    pub(crate) fn check(&self, checks: &mut Checks) {
        checks.positive("gages.noise_strain", self.noise_strain);
    }
}

/// What is wrong with one gage.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) enum GageState {
    #[default]
    Healthy,
    Bias {
        offset_m: f64,
    },
    /// Mean and standard deviation of the increment per step \[m\], and the offset so far \[m\].
    RandomWalk {
        mean_m: f64,
        deviation_m: f64,
        offset_m: f64,
    },
    ZeroOutput,
    NoSignal,
}

#[derive(Debug, Clone)]
struct Gage {
    noise_m: f64,
    noise: ChaCha8Rng,
    walk: ChaCha8Rng,
    state: GageState,
}

impl Gage {
    fn read(&mut self, elongation_m: f64) -> f64 {
        let noise = self.noise_m * normal(&mut self.noise);
        match &mut self.state {
            GageState::Healthy => elongation_m + noise,
            GageState::Bias { offset_m } => elongation_m + *offset_m + noise,
            GageState::RandomWalk { mean_m, deviation_m, offset_m } => {
                *offset_m += *mean_m + *deviation_m * normal(&mut self.walk);
                elongation_m + *offset_m + noise
            }
            GageState::ZeroOutput => noise,
            GageState::NoSignal => f64::NAN,
        }
    }
}

/// One draw from N(0, 1).
pub(crate) fn normal(generator: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(generator)
}

/// All gages of the structure.
#[derive(Debug, Clone)]
pub(crate) struct Gages {
    gages: Vec<Gage>,
}

impl Gages {
    /// Healthy gages with the given noise \[m\] each.
    pub(crate) fn new(noise_m: &[f64], seed: u64) -> Self {
        let gage = |(channel, &noise_m): (usize, &f64)| Gage {
            noise_m,
            noise: Stream::GageNoise(channel).generator(seed),
            walk: Stream::GageWalk(channel).generator(seed),
            state: GageState::Healthy,
        };
        Self { gages: noise_m.iter().enumerate().map(gage).collect() }
    }

    pub(crate) fn set(&mut self, gage: usize, state: GageState) {
        if let Some(gage) = self.gages.get_mut(gage) {
            gage.state = state;
        }
    }

    /// Turns true elongations into readings, in place \[m\].
    pub(crate) fn read(&mut self, elongations_m: &mut [f64]) {
        for (gage, elongation) in self.gages.iter_mut().zip(elongations_m) {
            *elongation = gage.read(*elongation);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE: [f64; 3] = [0.9e-6, 3.05e-6, 0.9e-6];
    const TRUE: [f64; 3] = [30e-6, -10e-6, 5e-6];

    fn readings(states: &[(usize, GageState)], count: usize) -> Vec<[f64; 3]> {
        let mut gages = Gages::new(&NOISE, 4);
        for (gage, state) in states {
            gages.set(*gage, *state);
        }
        (0..count)
            .map(|_| {
                let mut values = TRUE;
                gages.read(&mut values);
                values
            })
            .collect()
    }

    fn column(readings: &[[f64; 3]], gage: usize) -> Vec<f64> {
        readings.iter().map(|values| values[gage]).collect()
    }

    fn mean(values: &[f64]) -> f64 {
        values.iter().sum::<f64>() / values.len() as f64
    }

    fn covariance(one: &[f64], other: &[f64]) -> f64 {
        let (m, n) = (mean(one), mean(other));
        one.iter().zip(other).map(|(x, y)| (x - m) * (y - n)).sum::<f64>() / one.len() as f64
    }

    #[test]
    fn noise_has_its_deviation_no_mean_and_no_memory() {
        let readings = readings(&[], 100_000);
        for gage in 0..3 {
            let values = column(&readings, gage);
            let deviation = covariance(&values, &values).sqrt();
            assert!((deviation / NOISE[gage] - 1.0).abs() < 0.01, "{gage}: {deviation}");
            assert!((mean(&values) - TRUE[gage]).abs() < 0.015 * NOISE[gage]);
            let lagged = covariance(&values[1..], &values[..99_999]) / deviation.powi(2);
            assert!(lagged.abs() < 0.015, "{gage}: {lagged}");
        }
        let across = covariance(&column(&readings, 0), &column(&readings, 2));
        assert!((across / NOISE[0].powi(2)).abs() < 0.015);
    }

    #[test]
    fn a_fault_changes_its_own_gage_only_and_leaves_its_noise() {
        let healthy = readings(&[], 100);
        for (state, expected) in [
            (GageState::Bias { offset_m: 20e-6 }, 20e-6),
            (GageState::ZeroOutput, -TRUE[1]),
            (GageState::RandomWalk { mean_m: 1e-6, deviation_m: 0.0, offset_m: 0.0 }, 1e-6),
        ] {
            let faulty = readings(&[(1, state)], 100);
            assert!((faulty[0][1] - healthy[0][1] - expected).abs() < 1e-18);
            assert_eq!(column(&faulty, 0), column(&healthy, 0));
            assert_eq!(column(&faulty, 2), column(&healthy, 2));
        }
    }

    #[test]
    fn a_random_walk_has_normal_increments() {
        let (mean_m, deviation_m) = (1e-7, 2e-6);
        let walk = GageState::RandomWalk { mean_m, deviation_m, offset_m: 0.0 };
        let (faulty, healthy) = (readings(&[(0, walk)], 50_000), readings(&[], 50_000));
        let offsets: Vec<f64> = faulty.iter().zip(&healthy).map(|(f, h)| f[0] - h[0]).collect();
        let increments: Vec<f64> = offsets.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!((mean(&increments) - mean_m).abs() < 3.5e-8);
        let deviation = covariance(&increments, &increments).sqrt();
        assert!((deviation / deviation_m - 1.0).abs() < 0.015);
    }
}
