//! Computes the threshold that a channel's peaks reach at the tolerated rate.

use vocabulary::ComponentPath;

use super::largest_peaks::LargestPeaks;
use super::pareto::Pareto;
use super::pareto_fit::ParetoFit;

/// The tail contains one peak in this many.
const PEAKS_PER_EXCESS: u64 = 100;
/// Fewest peaks of a tail.
const FEWEST_EXCESSES: u64 = 50;
/// Largest standard deviation of ln γ, at which γ is known within a factor of two.
const LARGEST_SPREAD: f64 = std::f64::consts::LN_2;

/// Why peaks do not permit a threshold.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TailError {
    /// A rate out of range.
    #[error("{0} false alarms per hour; use a finite number above 0")]
    Rate(f64),
    /// Too few peaks.
    #[error(
        "`{channel}`: {found} peaks in {hours:.2} h are too few for a tail, which needs {}; calibrate on {:.2} h or more",
        FEWEST_EXCESSES * PEAKS_PER_EXCESS,
        needed_hours
    )]
    TooFew {
        /// The channel.
        channel: ComponentPath,
        /// Peaks found.
        found: u64,
        /// Hours of data.
        hours: f64,
        /// Hours needed.
        needed_hours: f64,
    },
    /// The tolerated rate is so high that its threshold is below the tail.
    #[error(
        "`{channel}`: {per_hour:.3} false alarms per hour of one channel are no rare event; its tail begins at {tail_per_hour:.0}, use less"
    )]
    TooFrequent {
        /// The channel.
        channel: ComponentPath,
        /// Tolerated of this channel.
        per_hour: f64,
        /// Peaks of the tail per hour.
        tail_per_hour: f64,
    },
    /// The peaks do not have a tail.
    #[error("`{channel}`: the {excesses} largest peaks are all alike; is its residual stuck?")]
    Alike {
        /// The channel.
        channel: ComponentPath,
        /// Peaks of the tail.
        excesses: usize,
    },
    /// The data leave the threshold too uncertain.
    #[error(
        "`{channel}`: {hours:.2} h leave the threshold uncertain by a factor of {factor:.1} (shape of the tail {shape:.2}); calibrate on about {needed_hours:.1} h or tolerate more false alarms"
    )]
    TooUncertain {
        /// The channel.
        channel: ComponentPath,
        /// Hours of data.
        hours: f64,
        /// exp of the standard deviation of ln γ.
        factor: f64,
        /// ξ.
        shape: f64,
        /// Approximate hours needed.
        needed_hours: f64,
    },
}

impl TailError {
    /// Approximate hours of data needed; infinite if more data would not help.
    #[must_use]
    pub fn needed_hours(&self) -> f64 {
        match self {
            TailError::TooFew { needed_hours, .. }
            | TailError::TooUncertain { needed_hours, .. } => *needed_hours,
            TailError::Rate(_) | TailError::TooFrequent { .. } | TailError::Alike { .. } => {
                f64::INFINITY
            }
        }
    }
}

/// A threshold, with the data that it is based on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TailThreshold {
    /// γ.
    pub threshold: f64,
    /// The tail above its level.
    pub tail: Pareto,
    /// D above which the tail begins.
    pub level: f64,
    /// Peaks above the level.
    pub excesses: usize,
    /// Standard deviation of ln γ.
    pub log_spread: f64,
}

/// The threshold that this channel's peaks in `hours` of data are expected to reach `per_hour` times an hour. Its tail
/// consists of the highest of every hundred peaks, if stored.
///
/// # Errors
/// Too few peaks, or all equal; a rate that is out of range, so high that it is not in the tail, or so low that the
/// data leave the threshold too uncertain.
pub fn tail_threshold(
    channel: &ComponentPath,
    peaks: &LargestPeaks,
    hours: f64,
    per_hour: f64,
) -> Result<TailThreshold, TailError> {
    let channel = channel.clone();
    let found = peaks.count();
    if found < FEWEST_EXCESSES * PEAKS_PER_EXCESS {
        let missing = (FEWEST_EXCESSES * PEAKS_PER_EXCESS) as f64 / found.max(1) as f64;
        return Err(TailError::TooFew { channel, found, hours, needed_hours: hours * missing });
    }
    let kept = peaks.falling();
    let share = usize::try_from(found / PEAKS_PER_EXCESS).unwrap_or(usize::MAX);
    let excesses = share.min(kept.len() - 1);
    let level = kept[excesses];
    let above: Vec<f64> = kept[..excesses].iter().map(|peak| peak - level).collect();
    let Some(fit) = ParetoFit::new(&above) else {
        return Err(TailError::Alike { channel, excesses });
    };
    if !(per_hour.is_finite() && per_hour > 0.0) {
        return Err(TailError::Rate(per_hour));
    }
    let tail_per_hour = excesses as f64 / hours;
    if per_hour >= tail_per_hour {
        return Err(TailError::TooFrequent { channel, per_hour, tail_per_hour });
    }
    let share = per_hour / tail_per_hour;
    let tail = fit.estimate();
    let log_spread = fit.log_spread(level, share);
    if log_spread > LARGEST_SPREAD {
        return Err(TailError::TooUncertain {
            channel,
            hours,
            factor: log_spread.exp(),
            shape: tail.shape,
            needed_hours: hours * (log_spread / LARGEST_SPREAD).powi(2),
        });
    }
    let threshold = level + fit.exceeded_with(share);
    Ok(TailThreshold { threshold, tail, level, excesses, log_spread })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha12Rng;

    const TRUE_TAIL: Pareto = Pareto { shape: 0.15, scale: 4e-4 };

    /// Peaks that are the sum of a level and a draw of the true tail.
    fn peaks(count: u64, seed: u64) -> LargestPeaks {
        let mut random = ChaCha12Rng::seed_from_u64(seed);
        let mut all = LargestPeaks::default();
        for _ in 0..count {
            all.push(1e-3 + TRUE_TAIL.exceeded_with(1.0 - random.random::<f64>()));
        }
        all
    }

    fn channel() -> ComponentPath {
        "module1/sensor/g5".parse().unwrap()
    }

    #[test]
    fn the_expected_rate_holds_on_average_over_samples() {
        // 1 h with 30 000 peaks; the threshold for one alarm in 20 h
        let rates: Vec<f64> = (0..200)
            .map(|seed| {
                let threshold = tail_threshold(&channel(), &peaks(30_000, seed), 1.0, 0.05);
                let threshold = threshold.unwrap().threshold;
                30_000.0 * TRUE_TAIL.survival(threshold - 1e-3)
            })
            .collect();
        let mean = rates.iter().sum::<f64>() / rates.len() as f64;
        assert!((0.03..0.08).contains(&mean), "{mean}");
    }

    #[test]
    fn too_few_peaks_are_refused_with_the_hours_that_are_needed() {
        let error = tail_threshold(&channel(), &peaks(1000, 1), 0.1, 1.0).unwrap_err().to_string();
        assert!(error.contains("`module1/sensor/g5`: 1000 peaks in 0.10 h"), "{error}");
        assert!(error.contains("needs 5000; calibrate on 0.50 h"), "{error}");
        let none = tail_threshold(&channel(), &LargestPeaks::default(), 0.1, 1.0).unwrap_err();
        assert!(matches!(none, TailError::TooFew { found: 0, .. }));
    }

    #[test]
    fn a_threshold_too_far_beyond_the_data_is_refused_with_the_hours_that_are_needed() {
        let threshold = |per_hour| tail_threshold(&channel(), &peaks(6000, 1), 0.2, per_hour);
        let error = threshold(1e-6).unwrap_err();
        let TailError::TooUncertain { needed_hours, .. } = error else { panic!("{error}") };
        assert!(needed_hours > 0.4, "{needed_hours}");
        assert!(threshold(20.0).is_ok());
    }

    #[test]
    fn a_rate_that_is_not_of_the_tail_is_refused() {
        let threshold = |per_hour| tail_threshold(&channel(), &peaks(6000, 1), 1.0, per_hour);
        assert!(matches!(threshold(61.0), Err(TailError::TooFrequent { .. })));
        for rate in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(threshold(rate), Err(TailError::Rate(_))));
        }
    }

    #[test]
    fn a_stuck_residual_is_refused() {
        let mut stuck = LargestPeaks::default();
        (0..9000).for_each(|_| stuck.push(0.25));
        let error = tail_threshold(&channel(), &stuck, 1.0, 1.0).unwrap_err();
        assert!(error.to_string().contains("all alike"), "{error}");
    }
}
