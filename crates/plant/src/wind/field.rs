//! Gusts at every level, of unlimited duration.
//!
//! Each level's gusts are a sum of some hundred sines (spectral representation, M. Shinozuka and
//! G. Deodatis, Applied Mechanics Reviews 44(4), 1991). The frequencies are spread logarithmically
//! and jittered within their bands, so the sum does not repeat; each line carries the whole power
//! of its band, in closed form.
//!
//! Coherence: for one line, the complex amplitudes of the levels from the bottom up are w₁ = e₁,
//! wᵢ = ρ wᵢ₋₁ + √(1 − ρ²) eᵢ, with eᵢ random phases and ρ Davenport's root coherence of the two neighbours. This is the
//! Cholesky factor of the cross-spectral matrix whose coherence is the product of those of neighbours; in closed form it
//! needs no matrix and cannot fail. Between levels further apart it differs from Davenport's formula only in how the
//! speeds are averaged.
//!
//! Evaluation: one phasor per line rotates by a fixed angle per instant and is normalised to the unit circle each time,
//! so its magnitude neither decays nor grows.

use std::f64::consts::TAU;

use rand::{Rng, RngExt};
use truss::vectorised;

use crate::wind::WindParameters;
use crate::wind::profile::{gust_deviation, mean_speed, turbulence_length};
use crate::wind::spectrum::{GustSpectrum, root_coherence};

/// Gusts of all levels, evaluated at equidistant instants.
#[derive(Debug, Clone)]
pub struct GustField {
    levels: usize,
    /// One per line: the phasor now, and its turn per instant (cosine, sine).
    phasors: Vec<[f64; 2]>,
    turns: Vec<[f64; 2]>,
    /// Line by line, the cosine amplitudes of all signals and then the sine amplitudes: the
    /// longitudinal gusts of all levels, then the lateral ones \[m/s\].
    amplitudes: Vec<f64>,
}

impl GustField {
    /// Draws a field for levels at the given heights \[m\], from the bottom up.
    ///
    /// `interval_s`: time between two instants \[s\].
    pub fn draw(
        wind: &WindParameters,
        base_speed: f64,
        heights_m: &[f64],
        interval_s: f64,
        generator: &mut impl Rng,
    ) -> Self {
        let levels = heights_m.len();
        let mut field = Self {
            levels,
            phasors: Vec::with_capacity(wind.lines),
            turns: Vec::with_capacity(wind.lines),
            amplitudes: Vec::with_capacity(wind.lines * 4 * levels),
        };
        for number in 0..wind.lines {
            let line = SpectralLine::draw(wind, number, generator);
            let angle = TAU * line.frequency_hz * interval_s;
            field.phasors.push([1.0, 0.0]);
            field.turns.push([angle.cos(), angle.sin()]);
            field.push_amplitudes(wind, base_speed, heights_m, line, generator);
        }
        field
    }

    fn push_amplitudes(
        &mut self,
        wind: &WindParameters,
        base_speed: f64,
        heights_m: &[f64],
        line: SpectralLine,
        generator: &mut impl Rng,
    ) {
        let deviation = gust_deviation(wind, base_speed);
        let sizes: Vec<f64> = heights_m
            .iter()
            .map(|&height| deviation * (2.0 * line.share(wind, base_speed, height)).sqrt())
            .collect();
        let coherences = neighbour_coherences(wind, base_speed, heights_m, line.frequency_hz);
        let mut cosines = Vec::with_capacity(2 * self.levels);
        let mut sines = Vec::with_capacity(2 * self.levels);
        for component_size in [1.0, wind.lateral_power_share.sqrt()] {
            let mut previous = [0.0; 2];
            for (&size, &coherence) in sizes.iter().zip(&coherences) {
                let phase = TAU * generator.random::<f64>();
                let fresh = (1.0 - coherence * coherence).max(0.0).sqrt();
                previous = [
                    coherence * previous[0] + fresh * phase.cos(),
                    coherence * previous[1] + fresh * phase.sin(),
                ];
                cosines.push(size * component_size * previous[0]);
                sines.push(-size * component_size * previous[1]);
            }
        }
        self.amplitudes.append(&mut cosines);
        self.amplitudes.append(&mut sines);
    }

    /// Number of levels.
    #[must_use]
    pub fn levels(&self) -> usize {
        self.levels
    }

    /// Writes the gusts of this instant \[m/s\] and advances to the next.
    ///
    /// `out`: longitudinal gusts of all levels from the bottom up, then the lateral ones; entries beyond twice the
    /// number of levels are not changed.
    pub fn next(&mut self, out: &mut [f64]) {
        vectorised(
            #[inline(always)]
            || self.evaluate(out),
        );
    }

    #[inline(always)]
    fn evaluate(&mut self, out: &mut [f64]) {
        let signals = 2 * self.levels;
        out.iter_mut().take(signals).for_each(|value| *value = 0.0);
        if signals == 0 {
            return;
        }
        let lines = self.amplitudes.chunks_exact(2 * signals);
        for ((phasor, turn), amplitudes) in self.phasors.iter_mut().zip(&self.turns).zip(lines) {
            let [cosine, sine] = *phasor;
            let (of_cosine, of_sine) = amplitudes.split_at(signals);
            for ((value, a), b) in out.iter_mut().zip(of_cosine).zip(of_sine) {
                *value = a.mul_add(cosine, b.mul_add(sine, *value));
            }
            *phasor = turned(*phasor, *turn);
        }
    }
}

/// Rotates a phasor and normalises it to the unit circle (one step of Newton's inverse root).
#[inline(always)]
fn turned([cosine, sine]: [f64; 2], [turn_cosine, turn_sine]: [f64; 2]) -> [f64; 2] {
    let real = cosine * turn_cosine - sine * turn_sine;
    let imaginary = sine * turn_cosine + cosine * turn_sine;
    let correction = 1.5 - 0.5 * (real * real + imaginary * imaginary);
    [real * correction, imaginary * correction]
}

/// Root coherence of each level with the one below; 0 for the lowest.
fn neighbour_coherences(
    wind: &WindParameters,
    base_speed: f64,
    heights_m: &[f64],
    frequency_hz: f64,
) -> Vec<f64> {
    let with_below = heights_m.windows(2).map(|pair| {
        let speed =
            0.5 * (mean_speed(wind, base_speed, pair[0]) + mean_speed(wind, base_speed, pair[1]));
        root_coherence(wind.coherence_decay, frequency_hz, pair[1] - pair[0], speed)
    });
    std::iter::once(0.0).chain(with_below).collect()
}

/// A line of the spectrum, which represents a band of frequencies; the bands of all lines form a geometric series.
#[derive(Debug, Clone, Copy)]
struct SpectralLine {
    /// A frequency in the band.
    frequency_hz: f64,
    low_hz: f64,
    high_hz: f64,
    /// Whether the band includes all power below it.
    first: bool,
}

impl SpectralLine {
    fn draw(wind: &WindParameters, number: usize, generator: &mut impl Rng) -> Self {
        let span = wind.highest_frequency_hz / wind.lowest_frequency_hz;
        let ratio = span.powf(1.0 / wind.lines as f64);
        let low_hz = wind.lowest_frequency_hz * ratio.powf(number as f64);
        let high_hz = low_hz * ratio;
        let position: f64 = generator.random();
        let frequency_hz = low_hz * (high_hz / low_hz).powf(position);
        Self { frequency_hz, low_hz, high_hz, first: number == 0 }
    }

    /// Share of the variance of this line at a height.
    fn share(&self, wind: &WindParameters, base_speed: f64, height_m: f64) -> f64 {
        let speed = mean_speed(wind, base_speed, height_m);
        let spectrum = GustSpectrum { time_scale_s: turbulence_length(wind, height_m) / speed };
        let below = if self.first { 0.0 } else { spectrum.share_below(self.low_hz) };
        spectrum.share_below(self.high_hz) - below
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::streams::Stream;

    const HEIGHTS: [f64; 4] = [9.0, 18.0, 27.0, 36.0];
    const BASE_SPEED: f64 = 12.0;

    fn field(seed: u64, interval_s: f64) -> GustField {
        let wind = WindParameters::default();
        let mut generator = Stream::Turbulence.generator(seed);
        GustField::draw(&wind, BASE_SPEED, &HEIGHTS, interval_s, &mut generator)
    }

    fn series(seed: u64, interval_s: f64, instants: usize) -> Vec<[f64; 8]> {
        let mut field = field(seed, interval_s);
        let mut out = [0.0; 8];
        (0..instants)
            .map(|_| {
                field.next(&mut out);
                out
            })
            .collect()
    }

    fn mean_product(series: &[[f64; 8]], one: usize, other: usize) -> f64 {
        series.iter().map(|values| values[one] * values[other]).sum::<f64>() / series.len() as f64
    }

    /// Over 20 seeds and an hour each: the variance is the spectrum's integral up to 10 Hz.
    #[test]
    fn the_variance_is_the_integral_of_the_spectrum() {
        let wind = WindParameters::default();
        for (signal, power) in [(0, 1.0), (3, 1.0), (4, 0.5), (7, 0.5)] {
            let height = HEIGHTS[signal % 4];
            let time_scale_s =
                turbulence_length(&wind, height) / mean_speed(&wind, BASE_SPEED, height);
            let share = GustSpectrum { time_scale_s }.share_below(wind.highest_frequency_hz);
            let expected = power * gust_deviation(&wind, BASE_SPEED).powi(2) * share;
            let variance = (0..20)
                .map(|seed| mean_product(&series(seed, 1.0, 3600), signal, signal))
                .sum::<f64>()
                / 20.0;
            assert!((variance / expected - 1.0).abs() < 0.1, "{signal}: {variance} {expected}");
        }
    }

    /// Power around a frequency, by summing the lines' own amplitudes, against the density.
    #[test]
    fn the_power_follows_the_spectrum_over_frequency() {
        let wind = WindParameters::default();
        let interval = 0.02;
        let time_scale_s = turbulence_length(&wind, 36.0) / mean_speed(&wind, BASE_SPEED, 36.0);
        let spectrum = GustSpectrum { time_scale_s };
        for (low, high) in [(0.002, 0.02), (0.02, 0.2), (0.2, 2.0), (2.0, 10.0)] {
            let mut power = 0.0;
            for seed in 0..100 {
                let field = field(seed, interval);
                for (turn, amplitudes) in field.turns.iter().zip(field.amplitudes.chunks_exact(16))
                {
                    let frequency = turn[1].atan2(turn[0]) / (TAU * interval);
                    if (low..high).contains(&frequency) {
                        power += 0.5 * (amplitudes[3].powi(2) + amplitudes[11].powi(2)) / 100.0;
                    }
                }
            }
            let below = if low == 0.002 { 0.0 } else { spectrum.share_below(low) };
            let expected =
                gust_deviation(&wind, BASE_SPEED).powi(2) * (spectrum.share_below(high) - below);
            assert!((power / expected - 1.0).abs() < 0.06, "{low}: {power} {expected}");
        }
    }

    /// Cross power of two levels over the geometric mean of their powers, per band of lines.
    #[test]
    fn the_coherence_is_davenports() {
        let wind = WindParameters::default();
        let interval = 0.02;
        for (one, other) in [(0, 1), (2, 3), (0, 3)] {
            for (low, high) in [(0.01, 0.012), (0.05, 0.06), (0.2, 0.24)] {
                let (mut cross, mut powers, mut expected, mut count) = (0.0, [0.0; 2], 0.0, 0.0);
                for seed in 0..400 {
                    let field = field(seed, interval);
                    for (turn, line) in field.turns.iter().zip(field.amplitudes.chunks_exact(16)) {
                        let frequency = turn[1].atan2(turn[0]) / (TAU * interval);
                        if (low..high).contains(&frequency) {
                            cross += line[one] * line[other] + line[one + 8] * line[other + 8];
                            powers[0] += line[one].powi(2) + line[one + 8].powi(2);
                            powers[1] += line[other].powi(2) + line[other + 8].powi(2);
                            let speed = 0.5
                                * (mean_speed(&wind, BASE_SPEED, HEIGHTS[one])
                                    + mean_speed(&wind, BASE_SPEED, HEIGHTS[other]));
                            let distance = HEIGHTS[other] - HEIGHTS[one];
                            expected += root_coherence(10.0, frequency, distance, speed);
                            count += 1.0;
                        }
                    }
                }
                let coherence = cross / (powers[0] * powers[1]).sqrt();
                let expected = expected / count;
                assert!(
                    (coherence - expected).abs() < 0.05,
                    "{one} {other} {low}: {coherence} {expected}"
                );
            }
        }
    }

    #[test]
    fn phasors_neither_decay_nor_grow() {
        let mut field = field(1, 0.02);
        let mut out = [0.0; 8];
        for _ in 0..1_000_000 {
            field.next(&mut out);
        }
        for [cosine, sine] in &field.phasors {
            assert!((cosine.hypot(*sine) - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn a_field_is_its_seeds() {
        assert_eq!(series(3, 0.02, 50), series(3, 0.02, 50));
        assert_ne!(series(3, 0.02, 50), series(4, 0.02, 50));
    }

    #[test]
    fn without_gusts_there_is_silence() {
        let wind = WindParameters { gust_factor: 0.0, ..WindParameters::default() };
        let mut generator = Stream::Turbulence.generator(1);
        let mut field = GustField::draw(&wind, BASE_SPEED, &HEIGHTS, 0.02, &mut generator);
        let mut out = [1.0; 8];
        field.next(&mut out);
        assert_eq!(out, [0.0; 8]);
    }
}
