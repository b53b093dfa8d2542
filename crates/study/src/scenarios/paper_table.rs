//! The paper's measure: shares of samples with and without a fault, flagged and not (Table 1).

use std::ops::Add;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use crate::statistics::{Interval95, on_the_way};

/// Number of bootstrap resamples of the scenarios for the intervals.
const RESAMPLES: usize = 2000;

/// Samples by true state and flag: counts, shares that sum to 1, or intervals of the shares.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct PaperTable<T> {
    /// Faulty and flagged.
    #[serde(rename = "tp")]
    pub true_positive: T,
    /// Faulty and not flagged.
    #[serde(rename = "fn")]
    pub false_negative: T,
    /// Healthy and flagged.
    #[serde(rename = "fp")]
    pub false_positive: T,
    /// Healthy and not flagged.
    #[serde(rename = "tn")]
    pub true_negative: T,
    /// Correctly flagged or not flagged.
    pub accuracy: T,
}

/// Table 1 of the paper, 30 scenarios.
pub const PAPER_TABLE: PaperTable<f64> = PaperTable {
    true_positive: 0.2518,
    false_negative: 0.0122,
    false_positive: 0.0,
    true_negative: 0.7360,
    accuracy: 0.2518 + 0.7360,
};

impl<T: Copy + Add<Output = T>> PaperTable<T> {
    /// Of true positives, false negatives, false positives and true negatives.
    pub(super) fn of(cells: [T; 4]) -> Self {
        let [true_positive, false_negative, false_positive, true_negative] = cells;
        let accuracy = true_positive + true_negative;
        Self { true_positive, false_negative, false_positive, true_negative, accuracy }
    }
}

fn shares(counts: impl Iterator<Item = PaperTable<u64>>) -> PaperTable<f64> {
    let mut sums = [0.0; 4];
    for of in counts {
        let counts = [of.true_positive, of.false_negative, of.false_positive, of.true_negative];
        sums.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count as f64);
    }
    let all: f64 = sums.iter().sum();
    let all = if all > 0.0 { all } else { 1.0 };
    PaperTable::of(sums.map(|sum| sum / all))
}

/// The shares over scenarios that were counted separately, and their intervals: percentiles over scenarios resampled
/// with replacement (Efron's bootstrap; the samples of one scenario are not independent observations).
pub(super) fn of(counts: &[PaperTable<u64>]) -> (PaperTable<f64>, PaperTable<Interval95>) {
    let table = shares(counts.iter().copied());
    // A fixed seed, so that the same records give the same intervals.
    let mut generator = ChaCha8Rng::seed_from_u64(0);
    let mut resampled = || {
        let draw = |_| counts[generator.random_range(0..counts.len())];
        shares((0..counts.len()).map(draw))
    };
    let resamples: Vec<PaperTable<f64>> = match counts.len() {
        0 => vec![table],
        _ => (0..RESAMPLES).map(|_| resampled()).collect(),
    };
    let interval =
        |of: fn(&PaperTable<f64>) -> f64| percentiles(resamples.iter().map(of).collect());
    let intervals = PaperTable {
        true_positive: interval(|table| table.true_positive),
        false_negative: interval(|table| table.false_negative),
        false_positive: interval(|table| table.false_positive),
        true_negative: interval(|table| table.true_negative),
        accuracy: interval(|table| table.accuracy),
    };
    (table, intervals)
}

fn percentiles(mut values: Vec<f64>) -> Interval95 {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| on_the_way(&values, share).unwrap_or(f64::NAN);
    Interval95(at(0.025), at(0.975))
}
