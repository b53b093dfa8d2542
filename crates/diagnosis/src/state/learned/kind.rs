//! Kind and size of a displaced channel, from what it is displaced by since its onset.

use serde::{Deserialize, Serialize};
use vocabulary::fault::FaultKind;
use vocabulary::{Candidate, FaultSize};

use super::LearnedChannel;
use crate::identification::{DECIDED, may_be_healthy};

/// The next kind has to fit so many times worse.
const CLEARER: f64 = 1.5;
/// A line fits at least as well as a constant.
const DRIFT_PENALTY: f64 = 2.0;
/// What is left may be so many times the wander before.
const MOST_LEFT: f64 = 2.0;
/// Displacements from which on a kind is told.
const LEAST: usize = 3;
/// Readings within this share of the range of zero are noise of a gage that is not there any more.
const ZERO: f64 = 1e-3;
/// Half-width of a 95 % interval, in standard deviations.
const NORMAL_95: f64 = 1.96;

/// A fit tells no probabilities: a kind that is decided is taken for as probable as it needs to be, any other for this.
const UNDECIDED: f64 = 0.5;

/// A window's displacement.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Displacement {
    pub(super) at_s: f64,
    pub(super) reading: f64,
    /// The reading less what the others say.
    pub(super) size: f64,
}

/// The kind that fits best.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FittedKind {
    /// The kind.
    pub kind: FaultKind,
    /// Is the next one clearly worse?
    pub decided: bool,
    /// In the channel's unit: of a bias and of what is stuck; in that per second: of a drift; of a gain, its factor.
    pub size: FaultSize,
    /// The reading that it should have had in its last window.
    pub expected: f64,
    /// Half-width of the 95 % interval of that.
    pub within: f64,
}

impl FittedKind {
    /// The same as what a fault may be.
    pub(crate) fn candidate(&self) -> Candidate {
        let probability = if self.decided { DECIDED } else { UNDECIDED };
        let size = self.kind.size_unit().map(|_| self.size);
        Candidate { kind: self.kind.into(), probability, size }
    }
}

/// What is known of a faulty channel: all that tells its kind.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DisplacedChannel {
    /// Window by window since the onset.
    pub(super) found: Vec<Displacement>,
    /// Displacements before the onset.
    pub(super) before: Vec<f64>,
    /// The size of a change that named it.
    pub(super) changed: Option<f64>,
    pub(super) channel: LearnedChannel,
    /// Standard deviation of the channel given the others.
    pub(super) deviation: f64,
}

impl DisplacedChannel {
    /// The displacement that the channel had before.
    fn rest(&self) -> f64 {
        let rest = super::window::median(&mut self.before.clone());
        if rest.is_finite() { rest } else { 0.0 }
    }

    /// What it should have read at last, and within what (95 %).
    pub(super) fn expected(&self) -> [f64; 2] {
        let last = self.found.last().map_or(f64::NAN, |last| last.reading - last.size);
        [last + self.rest(), NORMAL_95 * self.deviation]
    }

    /// Fits the kinds.
    pub(crate) fn fit(&self) -> Option<FittedKind> {
        let Self { found, before, changed, channel, .. } = self;
        found.last()?;
        let (rest, [expected, within]) = (self.rest(), self.expected());
        let sizes: Vec<f64> = found.iter().map(|d| d.size - rest).collect();
        let ones = vec![1.0; sizes.len()];
        // What the others say may be wrong in the same way all the time, at worst along what is fitted.
        let sized = |kind, value: f64, along: &[f64]| {
            let half = within / rms(along);
            let own_unit = kind != FaultKind::Gain;
            FaultSize { value, low: value - half, high: value + half, own_unit }
        };
        let told = |kind, decided, size| Some(FittedKind { kind, decided, size, expected, within });
        let level = |kind, decided, value| told(kind, decided, sized(kind, value, &ones));
        let mean = sizes.iter().sum::<f64>() / sizes.len() as f64;
        let (low, high) = found.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), d| {
            (l.min(d.reading), h.max(d.reading))
        });
        let largest = high.abs().max(low.abs());
        if found.len() >= LEAST && largest <= ZERO * channel.range() {
            return level(FaultKind::ZeroOutput, true, *sizes.last()?);
        }
        if found.len() >= LEAST && high - low <= f64::EPSILON * largest {
            return level(FaultKind::Stuck, true, *sizes.last()?);
        }
        if found.len() < LEAST {
            return level(FaultKind::Bias, false, changed.unwrap_or(mean));
        }
        let start = found[0].at_s;
        let times: Vec<f64> = found.iter().map(|d| d.at_s - start).collect();
        let truth: Vec<f64> = found.iter().zip(&sizes).map(|(d, size)| d.reading - size).collect();
        // A drift is found after it has begun, so that its line does not begin at zero.
        let middle = times.iter().sum::<f64>() / times.len() as f64;
        let (along, off): (Vec<f64>, Vec<f64>) =
            times.iter().zip(&sizes).map(|(time, size)| (time - middle, size - mean)).unzip();
        let fitted = |kind, along: &[f64], sizes: &[f64]| {
            let (size, left) = slope(along, sizes);
            let size = if kind == FaultKind::Gain { 1.0 + size } else { size };
            let penalty = if kind == FaultKind::Drift { DRIFT_PENALTY } else { 1.0 };
            (kind, penalty * left, sized(kind, size, along))
        };
        let mut fits = [
            fitted(FaultKind::Bias, &ones, &sizes),
            fitted(FaultKind::Drift, &along, &off),
            fitted(FaultKind::Gain, &truth, &sizes),
        ];
        fits.sort_by(|(_, a, _), (_, b, _)| a.total_cmp(b));
        let [best, (_, next, _), _] = fits;
        // A few windows may rise or fall by chance: that decides against the others, but for nothing.
        let is_fault = |(kind, _, size): &(FaultKind, f64, FaultSize)| {
            !may_be_healthy((*kind).into(), Some(size))
        };
        let (kind, left, size) = fits.into_iter().find(is_fault).unwrap_or(best);
        let wander = rms(&before.iter().map(|x| x - rest).collect::<Vec<_>>());
        let decided = is_fault(&best)
            && next > CLEARER * left
            && !before.is_empty()
            && left <= MOST_LEFT * wander;
        told(kind, decided, size)
    }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// The factor of `along` that fits best, and the rms of what is left.
fn slope(along: &[f64], sizes: &[f64]) -> (f64, f64) {
    let square = along.iter().map(|x| x * x).sum::<f64>();
    let product = along.iter().zip(sizes).map(|(x, y)| x * y).sum::<f64>();
    let factor = if square > 0.0 { product / square } else { 0.0 };
    let left = along.iter().zip(sizes).map(|(x, y)| (y - factor * x).powi(2)).sum::<f64>();
    (factor, (left / sizes.len() as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gage_that_reads_nothing_but_its_noise_has_no_output() {
        let channel = LearnedChannel {
            name: "g".to_owned(),
            lowest: -1.0,
            highest: 1.0,
            longest_constant_s: 9.0,
            smallest_found: 0.1,
        };
        let of = |found: Vec<(f64, f64)>| {
            let displacement = |(place, (reading, size)): (usize, (f64, f64))| Displacement {
                at_s: place as f64,
                reading,
                size,
            };
            let found = found.into_iter().enumerate().map(displacement).collect();
            let (before, changed, channel) = (vec![0.0, 0.01], Some(-0.3), channel.clone());
            DisplacedChannel { found, before, changed, channel, deviation: 0.01 }.fit().unwrap()
        };
        let truth = [0.3, 0.5, 0.2, 0.4];
        let fitted = |readings: [f64; 4]| {
            of(readings
                .into_iter()
                .zip(truth)
                .map(|(reading, truth)| (reading, reading - truth))
                .collect())
        };
        assert_eq!(fitted([1e-4, -2e-4, 0.0, 3e-4]).kind, FaultKind::ZeroOutput);
        assert_eq!(fitted([0.7; 4]).kind, FaultKind::Stuck);
        // After a jump, three windows that rise by chance are no evidence of a drift.
        let risen = of([0.500, 0.503, 0.506].map(|size| (size + 0.3, size)).to_vec());
        assert_eq!((risen.kind, risen.decided), (FaultKind::Bias, false), "{risen:?}");
        let half = fitted([0.15, 0.25, 0.1, 0.2]);
        assert_eq!((half.kind, half.decided), (FaultKind::Gain, true));
        assert!((half.size.value - 0.5).abs() < 0.02, "{half:?}");
    }
}
