//! Kind and size of a displaced channel, from what it is displaced by since its onset.

use serde::{Deserialize, Serialize};

use super::LearnedChannel;

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

/// A window's displacement.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Displacement {
    pub(super) at_s: f64,
    pub(super) reading: f64,
    /// The reading less what the others say.
    pub(super) size: f64,
}

/// What a displaced channel does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum DisplacementKind {
    /// The reading does not move.
    Stuck,
    /// The reading is zero.
    Zero,
    /// A constant is added.
    Bias,
    /// A ramp is added.
    Drift,
    /// It reads a multiple of the truth.
    Gain,
}

impl DisplacementKind {
    /// As machine output names it.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Stuck => "stuck",
            Self::Zero => "zero",
            Self::Bias => "bias",
            Self::Drift => "drift",
            Self::Gain => "gain",
        }
    }
}

/// The kind that fits best.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FittedKind {
    /// The kind.
    pub kind: DisplacementKind,
    /// Is the next one clearly worse?
    pub decided: bool,
    /// In the channel's unit: of a bias and of what is stuck; in that per second: of a drift; of a gain, its factor.
    pub size: f64,
    /// The reading that it should have had in its last window.
    pub expected: f64,
    /// Half-width of the 95 % interval of that.
    pub within: f64,
}

/// Fits the kinds; `before` are displacements before the onset, `changed` the size of a change that named it.
/// `deviation` is that of the channel given the others.
pub(super) fn fit(
    found: &[Displacement],
    before: &[f64],
    changed: Option<f64>,
    (channel, deviation): (&LearnedChannel, f64),
) -> Option<FittedKind> {
    let last = found.last()?;
    let rest = super::window::median(&mut before.to_vec());
    let rest = if rest.is_finite() { rest } else { 0.0 };
    let within = NORMAL_95 * deviation;
    let sizes: Vec<f64> = found.iter().map(|d| d.size - rest).collect();
    let expected = last.reading - (last.size - rest);
    let told = |kind, decided, size| Some(FittedKind { kind, decided, size, expected, within });
    let mean = sizes.iter().sum::<f64>() / sizes.len() as f64;
    let (low, high) = found
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), d| (l.min(d.reading), h.max(d.reading)));
    let largest = high.abs().max(low.abs());
    if found.len() >= LEAST && largest <= ZERO * channel.range() {
        return told(DisplacementKind::Zero, true, *sizes.last()?);
    }
    if found.len() >= LEAST && high - low <= f64::EPSILON * largest {
        return told(DisplacementKind::Stuck, true, *sizes.last()?);
    }
    if found.len() < LEAST {
        return told(DisplacementKind::Bias, false, changed.unwrap_or(mean));
    }
    let start = found[0].at_s;
    let times: Vec<f64> = found.iter().map(|d| d.at_s - start).collect();
    let truth: Vec<f64> = found.iter().zip(&sizes).map(|(d, size)| d.reading - size).collect();
    let ones = vec![1.0; sizes.len()];
    // A drift is found after it has begun, so that its line does not begin at zero.
    let middle = times.iter().sum::<f64>() / times.len() as f64;
    let (along, off): (Vec<f64>, Vec<f64>) =
        times.iter().zip(&sizes).map(|(time, size)| (time - middle, size - mean)).unzip();
    let (drift, left) = slope(&along, &off);
    let mut fits = [
        (DisplacementKind::Bias, slope(&ones, &sizes)),
        (DisplacementKind::Drift, (drift, left * DRIFT_PENALTY)),
        (DisplacementKind::Gain, slope(&truth, &sizes)),
    ];
    fits.sort_by(|(_, (_, a)), (_, (_, b))| a.total_cmp(b));
    let [(kind, (size, left)), (_, (_, next)), _] = fits;
    let wander = (before.iter().map(|x| (x - rest).powi(2)).sum::<f64>()
        / before.len().max(1) as f64)
        .sqrt();
    let decided = next > CLEARER * left && !before.is_empty() && left <= MOST_LEFT * wander;
    told(kind, decided, if kind == DisplacementKind::Gain { 1.0 + size } else { size })
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
        let fitted = |readings: [f64; 4]| {
            let truth = [0.3, 0.5, 0.2, 0.4];
            let displacement = |(place, reading): (usize, f64)| Displacement {
                at_s: place as f64,
                reading,
                size: reading - truth[place],
            };
            let found: Vec<_> = readings.into_iter().enumerate().map(displacement).collect();
            fit(&found, &[0.0, 0.01], Some(-0.3), (&channel, 0.01)).unwrap()
        };
        assert_eq!(fitted([1e-4, -2e-4, 0.0, 3e-4]).kind, DisplacementKind::Zero);
        assert_eq!(fitted([0.7; 4]).kind, DisplacementKind::Stuck);
        let half = fitted([0.15, 0.25, 0.1, 0.2]);
        assert_eq!((half.kind, half.decided), (DisplacementKind::Gain, true));
        assert!((half.size - 0.5).abs() < 0.02, "{half:?}");
    }
}
