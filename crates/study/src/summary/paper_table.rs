//! The paper's measure: shares of samples with and without a fault, flagged and not (Table 1).

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::interval::Interval95;
use crate::quantile::on_the_way;
use crate::record::{Confusion, ScenarioRecord};

/// How often the scenarios are resampled for the intervals.
const RESAMPLES: usize = 2000;

/// Shares of all samples; they sum to 1.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct PaperTable {
    /// Faulty and flagged.
    #[serde(rename = "tp")]
    pub true_positive: f64,
    /// Faulty and not flagged.
    #[serde(rename = "fn")]
    pub false_negative: f64,
    /// Healthy and flagged.
    #[serde(rename = "fp")]
    pub false_positive: f64,
    /// Healthy and not flagged.
    #[serde(rename = "tn")]
    pub true_negative: f64,
}

/// Table 1 of the paper, 30 scenarios.
pub const PAPER_TABLE: PaperTable = PaperTable {
    true_positive: 0.2518,
    false_negative: 0.0122,
    false_positive: 0.0,
    true_negative: 0.7360,
};

/// An interval for each share.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PaperTableIntervals {
    /// Faulty and flagged.
    #[serde(rename = "tp")]
    pub true_positive: Interval95,
    /// Faulty and not flagged.
    #[serde(rename = "fn")]
    pub false_negative: Interval95,
    /// Healthy and flagged.
    #[serde(rename = "fp")]
    pub false_positive: Interval95,
    /// Healthy and not flagged.
    #[serde(rename = "tn")]
    pub true_negative: Interval95,
    /// Flagged rightly.
    pub accuracy: Interval95,
}

impl PaperTable {
    fn of(confusions: impl Iterator<Item = Confusion>) -> Self {
        let (mut table, mut all) = (Self::default(), 0.0);
        for confusion in confusions {
            table.true_positive += confusion.true_positive as f64;
            table.false_negative += confusion.false_negative as f64;
            table.false_positive += confusion.false_positive as f64;
            table.true_negative += confusion.true_negative as f64;
        }
        all += table.true_positive + table.false_negative;
        all += table.false_positive + table.true_negative;
        let all = if all > 0.0 { all } else { 1.0 };
        Self {
            true_positive: table.true_positive / all,
            false_negative: table.false_negative / all,
            false_positive: table.false_positive / all,
            true_negative: table.true_negative / all,
        }
    }

    /// Share of samples that are flagged rightly.
    #[must_use]
    pub fn accuracy(&self) -> f64 {
        self.true_positive + self.true_negative
    }
}

/// The shares of these scenarios, and their intervals: percentiles over scenarios resampled with
/// replacement (Efron's bootstrap; the samples of one scenario are no independent observations).
pub(super) fn of(scenarios: &[&ScenarioRecord]) -> (PaperTable, PaperTableIntervals) {
    let confusions: Vec<Confusion> = scenarios.iter().map(|record| record.confusion()).collect();
    let table = PaperTable::of(confusions.iter().copied());
    // Seeded by nothing: the same records give the same intervals.
    let mut generator = ChaCha8Rng::seed_from_u64(0);
    let mut resampled = || {
        let draw = |_| confusions[generator.random_range(0..confusions.len())];
        PaperTable::of((0..confusions.len()).map(draw))
    };
    let resamples: Vec<PaperTable> = match confusions.len() {
        0 => vec![table],
        _ => (0..RESAMPLES).map(|_| resampled()).collect(),
    };
    let interval = |of: fn(&PaperTable) -> f64| percentiles(resamples.iter().map(of).collect());
    let intervals = PaperTableIntervals {
        true_positive: interval(|table| table.true_positive),
        false_negative: interval(|table| table.false_negative),
        false_positive: interval(|table| table.false_positive),
        true_negative: interval(|table| table.true_negative),
        accuracy: interval(PaperTable::accuracy),
    };
    (table, intervals)
}

fn percentiles(mut values: Vec<f64>) -> Interval95 {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| on_the_way(&values, share).unwrap_or(f64::NAN);
    Interval95(at(0.025), at(0.975))
}
