//! Strain gages with noise and their faults (section 3.3 of the paper).
//!
//! y = k ζ + b + ε (eq. 12), with ζ the elongation of the gage's member and ε normal noise. Healthy: k = 1, b = 0.
//! Bias: b constant. Random walk: b_{j+1} = b_j + δ_j from b = 0, with δ normal; the first faulty sample includes the
//! first increment. Drift: the same with δ constant. Gain: another k. Zero output: k = 0, with noise. Stuck: y is the
//! last reading before the fault, including its noise. Intermittent: b while a bad contact is open. No signal: y is
//! NaN. A healthy gage's k differs from 1 because of bonding and wiring, and the reading is a multiple of the
//! converter's resolution.
//!
//! Noise is drawn in every state, so that a repaired gage has the same noise as without the fault.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use crate::check::Checks;
use crate::contact::Contact;
use crate::streams::Stream;

/// The gages, which are all alike. Marks: \[E\] engineering estimate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GageParameters {
    /// Standard deviation of the noise as strain \[–\]: 0.3e-6; 0.9 µm on a member of 3 m \[E\].
    pub noise_strain: f64,
    /// Standard deviation of a healthy gage's gain from 1 \[–\]: 0.
    pub gain_error: f64,
    /// Seed of the gains: the same seed gives the same gages in all runs.
    pub gain_seed: u64,
    /// Resolution of the converter as strain \[–\]: 0 for a continuous reading.
    pub quantum_strain: f64,
}

impl Default for GageParameters {
    fn default() -> Self {
        Self { noise_strain: 0.3e-6, gain_error: 0.0, gain_seed: 0, quantum_strain: 0.0 }
    }
}

impl GageParameters {
    pub(crate) fn check(&self, checks: &mut Checks) {
        checks.within("gages.noise_strain", self.noise_strain, 1e-15..=0.01, "m/m");
        let small = (0.0..=0.2).contains(&self.gain_error);
        checks.require("gages.gain_error", small, self.gain_error, "a deviation from 0 to 0.2");
        checks.within("gages.quantum_strain", self.quantum_strain, 0.0..=0.01, "m/m");
    }
}

/// The state of one gage.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) enum GageState {
    #[default]
    Healthy,
    Bias {
        offset_m: f64,
    },
    /// Increment per step \[m\], and the offset so far \[m\].
    Drift {
        increment_m: f64,
        offset_m: f64,
    },
    /// Mean and standard deviation of the increment per step \[m\], and the offset so far \[m\].
    RandomWalk {
        mean_m: f64,
        deviation_m: f64,
        offset_m: f64,
    },
    /// Factor on the reading of a healthy gage.
    Gain {
        gain: f64,
    },
    ZeroOutput,
    Stuck,
    /// The offset while the contact is open \[m\].
    Intermittent {
        offset_m: f64,
        contact: Contact,
    },
    NoSignal,
}

#[derive(Debug, Clone)]
struct SimulatedGage {
    noise_m: f64,
    gain: f64,
    quantum_m: f64,
    noise: ChaCha8Rng,
    walk: ChaCha8Rng,
    state: GageState,
    /// The last reading \[m\].
    last_m: Option<f64>,
}

impl SimulatedGage {
    fn read(&mut self, elongation_m: f64) -> f64 {
        let Some(analogue_m) = self.analogue_m(elongation_m) else { return f64::NAN };
        let reading_m = if self.quantum_m > 0.0 {
            self.quantum_m * (analogue_m / self.quantum_m).round()
        } else {
            analogue_m
        };
        self.last_m = Some(reading_m);
        reading_m
    }

    /// The input of its converter; `None` without a signal.
    fn analogue_m(&mut self, elongation_m: f64) -> Option<f64> {
        let noise = self.noise_m * normal(&mut self.noise);
        let amplified_m = self.gain * elongation_m;
        Some(match &mut self.state {
            GageState::Healthy => amplified_m + noise,
            GageState::Bias { offset_m } => amplified_m + *offset_m + noise,
            GageState::Drift { increment_m, offset_m } => {
                *offset_m += *increment_m;
                amplified_m + *offset_m + noise
            }
            GageState::RandomWalk { mean_m, deviation_m, offset_m } => {
                *offset_m += *mean_m + *deviation_m * normal(&mut self.walk);
                amplified_m + *offset_m + noise
            }
            GageState::Gain { gain } => *gain * amplified_m + noise,
            GageState::ZeroOutput => noise,
            // Rounding does not change a multiple of the quantum.
            GageState::Stuck => self.last_m.unwrap_or(amplified_m + noise),
            GageState::Intermittent { offset_m, contact } => {
                let offset_m = if contact.is_open(&mut self.walk) { *offset_m } else { 0.0 };
                amplified_m + offset_m + noise
            }
            GageState::NoSignal => return None,
        })
    }
}

fn gain(parameters: &GageParameters, channel: usize) -> f64 {
    let mut generator = Stream::GageGain(channel).generator(parameters.gain_seed);
    1.0 + parameters.gain_error * normal(&mut generator)
}

/// One draw from N(0, 1).
pub(crate) fn normal(generator: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(generator)
}

/// All gages of the structure.
#[derive(Debug, Clone)]
pub(crate) struct Gages {
    gages: Vec<SimulatedGage>,
}

impl Gages {
    /// Healthy gages on members of the given lengths \[m\].
    pub(crate) fn new(parameters: &GageParameters, lengths_m: &[f64], seed: u64) -> Self {
        let gage = |(channel, &length_m): (usize, &f64)| SimulatedGage {
            noise_m: parameters.noise_strain * length_m,
            gain: gain(parameters, channel),
            quantum_m: parameters.quantum_strain * length_m,
            noise: Stream::GageNoise(channel).generator(seed),
            walk: Stream::GageWalk(channel).generator(seed),
            state: GageState::Healthy,
            last_m: None,
        };
        Self { gages: lengths_m.iter().enumerate().map(gage).collect() }
    }

    pub(crate) fn set(&mut self, gage: usize, state: GageState) {
        if let Some(gage) = self.gages.get_mut(gage) {
            gage.state = state;
        }
    }

    /// What a healthy gage multiplies an elongation by.
    pub(crate) fn gain(&self, gage: usize) -> f64 {
        self.gages[gage].gain
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

    const LENGTHS: [f64; 3] = [3.0, 10.0, 3.0];
    const NOISE: [f64; 3] = [0.9e-6, 3.0e-6, 0.9e-6];
    const TRUE: [f64; 3] = [30e-6, -10e-6, 5e-6];

    fn readings(states: &[(usize, GageState)], count: usize) -> Vec<[f64; 3]> {
        readings_of(&GageParameters::default(), states, count)
    }

    fn readings_of(
        parameters: &GageParameters,
        states: &[(usize, GageState)],
        count: usize,
    ) -> Vec<[f64; 3]> {
        let mut gages = Gages::new(parameters, &LENGTHS, 4);
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

    fn intermittent(offset_m: f64, closed_s: f64, open_s: f64) -> GageState {
        GageState::Intermittent { offset_m, contact: Contact::new(closed_s, open_s, 1e-3) }
    }

    /// What a gage reads while its member moves, and what it would read if it were healthy; the fault is there in these
    /// samples.
    fn moving(
        parameters: &GageParameters,
        state: GageState,
        faulty_in: std::ops::Range<i32>,
    ) -> Vec<[f64; 2]> {
        let mut faulty = Gages::new(parameters, &LENGTHS, 4);
        let mut healthy = faulty.clone();
        let sample = |step| {
            if step == faulty_in.start {
                faulty.set(0, state);
            }
            if step == faulty_in.end {
                faulty.set(0, GageState::Healthy);
            }
            let truth = [50e-6 * (f64::from(step) * 0.1).sin(), 0.0, 0.0];
            let (mut with, mut without) = (truth, truth);
            faulty.read(&mut with);
            healthy.read(&mut without);
            assert_eq!(with[1..], without[1..]);
            [with[0], without[0]]
        };
        (0..100).map(sample).collect()
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
            (GageState::Drift { increment_m: 1e-6, offset_m: 0.0 }, 1e-6),
            (GageState::Gain { gain: 0.8 }, -0.2 * TRUE[1]),
            (intermittent(20e-6, 0.05, 0.01), 20e-6),
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
    fn gains_differ_from_gage_to_gage_and_readings_are_multiples_of_the_quantum() {
        let parameters = GageParameters {
            noise_strain: 1e-12,
            gain_error: 0.02,
            gain_seed: 0,
            quantum_strain: 0.5e-6,
        };
        let gains: Vec<f64> = (0..3)
            .map(|gage| mean(&column(&readings_of(&parameters, &[], 10), gage)) / TRUE[gage])
            .collect();
        assert!(gains[0] != gains[2], "{gains:?}");
        for (gage, length) in LENGTHS.into_iter().enumerate() {
            let multiple = readings_of(&parameters, &[], 1)[0][gage] / (0.5e-6 * length);
            assert!((multiple - multiple.round()).abs() < 1e-9, "{multiple}");
        }
    }

    #[test]
    fn a_wrong_gain_multiplies_what_a_healthy_gage_makes_of_the_elongation() {
        let parameters =
            GageParameters { noise_strain: 1e-15, gain_error: 0.02, ..GageParameters::default() };
        for [faulty, healthy] in moving(&parameters, GageState::Gain { gain: 1.3 }, 0..100) {
            assert!((faulty - 1.3 * healthy).abs() < 1e-13, "{faulty} {healthy}");
        }
        let noisy = moving(&GageParameters::default(), GageState::Gain { gain: 1.0 }, 0..100);
        assert!(noisy.iter().all(|[faulty, healthy]| faulty == healthy));
    }

    #[test]
    fn a_drift_grows_by_the_same_in_every_sample() {
        let increment_m = 2e-6;
        let drift = GageState::Drift { increment_m, offset_m: 0.0 };
        let readings = moving(&GageParameters::default(), drift, 0..100);
        for (sample, [faulty, healthy]) in (1..).map(f64::from).zip(readings) {
            assert!((faulty - healthy - sample * increment_m).abs() < 1e-17);
        }
    }

    #[test]
    fn a_stuck_gage_repeats_its_last_reading_while_its_member_moves() {
        for quantum_strain in [0.0, 0.3e-6] {
            let parameters = GageParameters { quantum_strain, ..GageParameters::default() };
            let readings = moving(&parameters, GageState::Stuck, 30..70);
            for (step, [faulty, healthy]) in readings.iter().enumerate() {
                let expected = if (30..70).contains(&step) { readings[29][0] } else { *healthy };
                assert_eq!(faulty.to_bits(), expected.to_bits(), "{step}");
            }
            let readings = moving(&parameters, GageState::Stuck, 0..70);
            assert!(readings[..70].iter().all(|[faulty, _]| *faulty == readings[0][1]));
        }
    }

    #[test]
    fn a_stuck_gage_repeats_the_last_reading_that_it_gave_and_no_missing_one() {
        let mut gages = Gages::new(&GageParameters::default(), &LENGTHS, 4);
        let mut read = |state| {
            gages.set(0, state);
            let mut values = TRUE;
            gages.read(&mut values);
            values[0]
        };
        let biased = read(GageState::Bias { offset_m: 1e-3 });
        assert!(read(GageState::NoSignal).is_nan());
        assert_eq!([read(GageState::Stuck), read(GageState::Stuck)], [biased; 2]);
    }

    #[test]
    fn a_bad_contact_offsets_the_reading_while_it_is_open_and_leaves_it_alone_else() {
        let (offset_m, count) = (20e-6, 100_000);
        let (faulty, healthy) =
            (readings(&[(0, intermittent(offset_m, 0.05, 0.01))], count), readings(&[], count));
        let mut open = 0.0;
        for (faulty, healthy) in faulty.iter().zip(&healthy) {
            if faulty[0] != healthy[0] {
                assert!((faulty[0] - healthy[0] - offset_m).abs() < 1e-18);
                open += 1.0;
            }
        }
        // The share over 100 s with the memory of 8.3 ms deviates by 0.0048.
        let share: f64 = open / count as f64;
        assert!((share - 0.01 / 0.06).abs() < 4.0 * 0.0048, "{share}");
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
