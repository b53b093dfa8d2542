//! Samples to medians of windows.

use serde::{Deserialize, Serialize};

/// Samples of a window, at this step and length \[s\]; at least one.
pub(super) fn samples_per_window(step_s: f64, window_s: f64) -> usize {
    (window_s / step_s).round().max(1.0) as usize
}

/// The median of a window's samples; NaN if fewer than half of them are numbers. Reorders them.
pub(super) fn median(samples: &mut [f64]) -> f64 {
    let mut finite = 0;
    for place in 0..samples.len() {
        if samples[place].is_finite() {
            samples.swap(finite, place);
            finite += 1;
        }
    }
    if finite == 0 || 2 * finite < samples.len() {
        return f64::NAN;
    }
    let (below, upper, _) = samples[..finite].select_nth_unstable_by(finite / 2, f64::total_cmp);
    if finite % 2 == 1 {
        return *upper;
    }
    let lower = below.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    f64::midpoint(lower, *upper)
}

/// Medians of the windows of a channel, the last one only if it is whole.
pub(super) fn medians(samples: &[f64], per_window: usize) -> Vec<f64> {
    samples.chunks_exact(per_window).map(|window| median(&mut window.to_vec())).collect()
}

/// How long a channel has kept its value.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct ConstantRun {
    value: Option<f64>,
    samples: usize,
}

impl ConstantRun {
    /// Takes a sample: samples in a row with its value. Missing ones interrupt nothing.
    pub(super) fn take(&mut self, sample: f64) -> usize {
        if sample.is_finite() {
            self.samples = if self.value == Some(sample) { self.samples + 1 } else { 1 };
            self.value = Some(sample);
        }
        self.samples
    }
}

/// The longest run of one value, in samples.
pub(super) fn longest_run(samples: &[f64]) -> usize {
    let mut run = ConstantRun::default();
    samples.iter().map(|&sample| run.take(sample)).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_needs_half_of_its_samples() {
        let nan = f64::NAN;
        assert_eq!(medians(&[3.0, 1.0, 2.0, 9.0], 4), [2.5]);
        assert_eq!(medians(&[nan, 1.0, nan, 3.0, 5.0], 4), [2.0]);
        assert!(medians(&[nan, nan, -nan, 3.0], 4)[0].is_nan());
        assert_eq!(medians(&[f64::INFINITY, 1.0, 2.0, -nan], 4), [1.5]);
        assert_eq!(samples_per_window(0.2, 1.0), 5);
        assert_eq!(samples_per_window(5.0, 1.0), 1);
    }

    #[test]
    fn runs_of_one_value_are_counted_over_missing_samples() {
        assert_eq!(longest_run(&[1.0, 1.0, f64::NAN, 1.0, 2.0]), 3);
        assert_eq!(longest_run(&[]), 0);
    }
}
