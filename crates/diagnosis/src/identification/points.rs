//! How steps are gathered to points: single steps around the onset, blocks farther away, longer ones still farther.

use std::ops::Range;

use vocabulary::Step;

use super::excerpt::{Excerpt, FaultOnset};

/// Single steps from so long before the onset until so long after its detection \[s\]; then means over blocks.
pub(super) const FINE_BEFORE_S: f64 = 0.01;
const FINE_AFTER_S: f64 = 0.06;
/// Length of a block \[s\]; farther than this before or after the detection so many times that \[s\].
pub(super) const BLOCK_S: f64 = 0.01;
const NEAR_S: f64 = 0.5;
const FAR_TIMES: usize = 4;

/// How the steps of an excerpt are gathered.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grouping {
    /// Length of a step \[s\].
    pub(super) step_s: f64,
    /// From when on single steps count \[s\], from the detection on; never, if no onset was seen.
    pub(super) fine_from_s: f64,
    detection: Step,
    block: usize,
}

impl Grouping {
    pub(super) fn of(excerpt: &Excerpt) -> Self {
        let step_s = excerpt.step_s;
        let detection = excerpt.seen.detection();
        let fine_from_s = match excerpt.seen {
            FaultOnset::Change { onset, .. } => {
                (onset.0 as f64 - detection.0 as f64) * step_s - FINE_BEFORE_S
            }
            FaultOnset::Departure { .. } => f64::INFINITY,
        };
        let block = ((BLOCK_S / step_s).round() as usize).max(1);
        Self { step_s, fine_from_s, detection, block }
    }

    /// The step at a time \[s\] from the detection on.
    pub(super) fn step_at(&self, at_s: f64) -> Step {
        let off = (at_s / self.step_s).round();
        Step(self.detection.0.saturating_add_signed(off as i64))
    }

    /// When a step is \[s\], from the detection on.
    pub(super) fn at_s(&self, step: Step) -> f64 {
        (step.0 as f64 - self.detection.0 as f64) * self.step_s
    }

    /// Which steps, given by their times, make a point each.
    pub(super) fn group(&self, times: &[f64]) -> Vec<Range<usize>> {
        let is_fine = |at: f64| at >= self.fine_from_s && at <= FINE_AFTER_S;
        let mut groups = Vec::new();
        let mut from = 0;
        while from < times.len() {
            let is_far = times[from].abs() > NEAR_S;
            let blocks = if is_far { FAR_TIMES } else { 1 };
            let most = if is_fine(times[from]) { from + 1 } else { from + blocks * self.block };
            let most = most.min(times.len());
            let longest_s = 1.5 * BLOCK_S * blocks as f64;
            let ends = |at_s: f64| {
                is_fine(at_s) || at_s - times[from] > longest_s || is_far && at_s.abs() <= NEAR_S
            };
            let until = (from + 1..most).find(|k| ends(times[*k])).unwrap_or(most);
            groups.push(from..until);
            from = until;
        }
        groups
    }
}
