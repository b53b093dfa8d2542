//! What the rank-one changes of the last l steps say about the divergence, without cancellation.
//!
//! Between the Gaussian of l steps ago and the present one lie at most 2·l rank-one changes of the
//! scatter, C ← C + cᵢ·uᵢ·uᵢᵀ with sᵢ = 1 + cᵢ·uᵢᵀC⁻¹uᵢ. With qᵢ = uᵢᵀC_k⁻¹uᵢ taken at the *present*
//! scatter,
//!
//! - tr(C_k⁻¹·C_{k−l}) = w − T, T = Σ cᵢ·qᵢ
//! - ln det C_k − ln det C_{k−l} = Λ = Σ ln sᵢ
//!
//! and both cancel to second order in the divergence: Λ − T. Each later change m lowers
//! cᵢ·qᵢ = 1 − 1/sᵢ (its value right after change i) by cᵢ·cₘ·sₘ·(uᵢᵀC_m⁻¹uₘ)², so that
//!
//! - Λ − T = Σ hᵢ + Σ aᵢ, hᵢ = ln sᵢ − 1 + 1/sᵢ, aᵢ = Σ_{m>i} cᵢ·(sₘ/cₘ)·(uᵢᵀgₘ)²
//!
//! with the gain gₘ = cₘ·C_m⁻¹uₘ. Every term is of second order: nothing is lost to cancellation, and
//! a term lives for l steps only: nothing drifts. The shift of the mean is summed from the same
//! changes, δ = Σ (share of uᵢ): carried along, and recomputed once an interval. Cost: O(l·w) a step.

use super::accumulator::RankOne;
use super::lanes::{Instructions, LANES, Lane, splat};

/// One recorded change; all zero where nothing changed.
#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
struct Term {
    weight: Lane,
    mean_share: Lane,
    /// hᵢ.
    surplus: Lane,
    /// 1 − 1/sᵢ.
    settled: Lane,
    /// aᵢ.
    lowered: Lane,
}

const NOTHING: Term = Term {
    weight: splat(0.0),
    mean_share: splat(0.0),
    surplus: splat(0.0),
    settled: splat(0.0),
    lowered: splat(0.0),
};

/// The rank-one changes of the last l steps, two places a step: an addition and a deletion.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct RecentChanges {
    dimension: usize,
    deviations: Vec<Lane>,
    terms: Vec<Term>,
    next: usize,
    shift: Vec<Lane>,
}

impl RecentChanges {
    /// Room for `steps` steps of vectors of `dimension` elements.
    pub(super) fn new(dimension: usize, steps: usize) -> Self {
        Self {
            dimension,
            deviations: vec![splat(0.0); 2 * steps * dimension],
            terms: vec![NOTHING; 2 * steps],
            next: 0,
            shift: vec![splat(0.0); dimension],
        }
    }

    /// Starts writing at the first place again, as a new one would.
    pub(super) fn rewind(&mut self) {
        self.next = 0;
    }

    /// Forgets every change of one channel.
    pub(super) fn clear(&mut self, lane: usize) {
        self.deviations.iter_mut().for_each(|u| u[lane] = 0.0);
        for term in &mut self.terms {
            let Term { weight, mean_share, surplus, settled, lowered } = term;
            for part in [weight, mean_share, surplus, settled, lowered] {
                part[lane] = 0.0;
            }
        }
        self.shift.iter_mut().for_each(|s| s[lane] = 0.0);
    }

    /// Records one change with its deviation u and gain g; the oldest one falls out.
    #[inline(always)]
    pub(super) fn push(
        &mut self,
        on: impl Instructions,
        change: RankOne,
        deviation: &[Lane],
        gain: &[Lane],
    ) {
        self.forget_oldest(on);
        self.lower_earlier(on, change, gain);
        on.add_scaled(&mut self.shift, on.load(&change.mean_share), deviation);
        self.deviations[self.next * self.dimension..][..self.dimension].copy_from_slice(deviation);
        let mut term = Term { weight: change.weight, mean_share: change.mean_share, ..NOTHING };
        for lane in 0..LANES {
            let growth = change.growth[lane];
            term.settled[lane] = growth / (1.0 + growth);
            term.surplus[lane] = libm::log1p(growth) - term.settled[lane];
        }
        self.terms[self.next] = term;
        self.advance();
    }

    /// Records that nothing changed in this place; the oldest change falls out.
    #[inline(always)]
    pub(super) fn push_nothing(&mut self, on: impl Instructions) {
        self.forget_oldest(on);
        self.advance();
    }

    /// Empties the place that is written next.
    #[inline(always)]
    fn forget_oldest(&mut self, on: impl Instructions) {
        let share = on.sub(on.splat(0.0), on.load(&self.terms[self.next].mean_share));
        let oldest = &self.deviations[self.next * self.dimension..][..self.dimension];
        on.add_scaled(&mut self.shift, share, oldest);
        self.terms[self.next] = NOTHING;
    }

    #[inline(always)]
    fn advance(&mut self) {
        self.next = if self.next + 1 == self.terms.len() { 0 } else { self.next + 1 };
    }

    #[inline(always)]
    fn lower_earlier(&mut self, on: impl Instructions, change: RankOne, gain: &[Lane]) {
        let mut scale = splat(0.0);
        for lane in (0..LANES).filter(|&lane| change.weight[lane] != 0.0) {
            scale[lane] = (1.0 + change.growth[lane]) / change.weight[lane];
        }
        let scale = on.load(&scale);
        for (term, u) in self.terms.iter_mut().zip(self.deviations.chunks_exact(self.dimension)) {
            let projected = on.dot(u, gain);
            let factor = on.mul(on.load(&term.weight), scale);
            let lowered = on.mul(factor, on.mul(projected, projected));
            let sum = on.add(on.load(&term.lowered), lowered);
            on.store(&mut term.lowered, sum);
        }
    }

    /// Λ − T and T, summed over all recorded changes.
    #[inline(always)]
    pub(super) fn excess_and_trace_loss(&self) -> (Lane, Lane) {
        let (mut excess, mut trace_loss) = (splat(0.0), splat(0.0));
        for term in &self.terms {
            for i in 0..LANES {
                excess[i] += term.surplus[i] + term.lowered[i];
                trace_loss[i] += term.settled[i] - term.lowered[i];
            }
        }
        (excess, trace_loss)
    }

    /// Λ − T and δ of additions alone, or of deletions alone.
    pub(super) fn part(&self, of_deletions: bool) -> (Lane, Vec<Lane>) {
        let (mut excess, mut shift) = (splat(0.0), vec![splat(0.0); self.dimension]);
        for (term, u) in self.terms.iter().zip(self.deviations.chunks_exact(self.dimension)) {
            for lane in (0..LANES).filter(|&lane| (term.weight[lane] < 0.0) == of_deletions) {
                excess[lane] += term.surplus[lane] + term.lowered[lane];
                for (s, u) in shift.iter_mut().zip(u) {
                    s[lane] += term.mean_share[lane] * u[lane];
                }
            }
        }
        (excess, shift)
    }

    /// δ: by how much the recorded changes moved the mean.
    #[inline(always)]
    pub(super) fn mean_shift(&self) -> &[Lane] {
        &self.shift
    }

    /// Recomputes δ of one channel, so that the rounding of many steps does not pile up. Returns how
    /// many operations that took.
    pub(super) fn refresh_mean_shift(&mut self, lane: usize) -> usize {
        self.shift.iter_mut().for_each(|s| s[lane] = 0.0);
        for (term, u) in self.terms.iter().zip(self.deviations.chunks_exact(self.dimension)) {
            for (s, u) in self.shift.iter_mut().zip(u) {
                s[lane] += term.mean_share[lane] * u[lane];
            }
        }
        2 * self.deviations.len()
    }
}
