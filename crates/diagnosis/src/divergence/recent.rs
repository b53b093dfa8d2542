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

use super::accumulator::{Accumulator, RankOne, Row};
use super::lanes::{Instructions, LANES, Lane, splat};

/// One recorded change; all zero where nothing changed.
#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
struct Term {
    weight: Lane,
    mean_share: Lane,
    /// ln sᵢ.
    log: Lane,
    /// hᵢ + aᵢ.
    excess: Lane,
}

const NOTHING: Term =
    Term { weight: splat(0.0), mean_share: splat(0.0), log: splat(0.0), excess: splat(0.0) };

/// The rank-one changes of the last l steps: of each an addition and a deletion.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct RecentChanges {
    dimension: usize,
    /// Both u of one step after the other, element by element.
    deviations: Vec<[Lane; 2]>,
    terms: Vec<[Term; 2]>,
    /// Which step is the oldest one, and written next.
    next: usize,
    shift: Vec<Lane>,
}

impl RecentChanges {
    /// Room for `steps` steps of vectors of `dimension` elements.
    pub(super) fn new(dimension: usize, steps: usize) -> Self {
        Self {
            dimension,
            deviations: vec![[splat(0.0); 2]; steps * dimension],
            terms: vec![[NOTHING; 2]; steps],
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
        self.deviations.as_flattened_mut().iter_mut().for_each(|u| u[lane] = 0.0);
        for term in self.terms.as_flattened_mut() {
            let Term { weight, mean_share, log, excess } = term;
            for part in [weight, mean_share, log, excess] {
                part[lane] = 0.0;
            }
        }
        self.shift.iter_mut().for_each(|s| s[lane] = 0.0);
    }

    /// Moves the accumulator's mean on by a vector that is added, and one that is deleted, and records their u in place of
    /// the oldest step's.
    #[inline(always)]
    pub(super) fn move_mean(
        &mut self,
        on: impl Instructions,
        accumulator: &mut Accumulator,
        vectors: [&[Lane]; 2],
        taking: [Lane; 2],
    ) -> [RankOne; 2] {
        let changes = accumulator.count_changes(taking);
        let terms = &self.terms[self.next];
        let gone = [on.load(&terms[0].mean_share), on.load(&terms[1].mean_share)];
        let come = [on.load(&changes[0].mean_share), on.load(&changes[1].mean_share)];
        let vectors = vectors.map(|vector| &vector[..self.shift.len()]);
        let kept = &mut self.deviations[self.next * self.dimension..][..self.dimension];
        for (place, (kept, shift)) in kept.iter_mut().zip(&mut self.shift).enumerate() {
            let mut sum = on.load(shift);
            sum = on.sub_mul(sum, gone[0], on.load(&kept[0]));
            sum = on.sub_mul(sum, gone[1], on.load(&kept[1]));
            let elements = [&vectors[0][place], &vectors[1][place]];
            let [added, deleted] = accumulator.move_mean(on, place, elements, come);
            sum = on.mul_add(come[0], added, sum);
            sum = on.mul_add(come[1], deleted, sum);
            on.store(shift, sum);
            on.store(&mut kept[0], added);
            on.store(&mut kept[1], deleted);
        }
        changes
    }

    /// The u that were recorded last.
    #[inline(always)]
    pub(super) fn latest(&self) -> &[[Lane; 2]] {
        &self.deviations[self.next * self.dimension..][..self.dimension]
    }

    /// δ: by how much the recorded changes moved the mean.
    #[inline(always)]
    pub(super) fn mean_shift(&self) -> &[Lane] {
        &self.shift
    }

    /// Records what the step's changes, whose gains are in the rows, say, and returns Λ − T of all steps.
    #[inline(always)]
    pub(super) fn record(
        &mut self,
        on: impl Instructions,
        changes: &[RankOne; 2],
        rows: &[Row],
    ) -> Lane {
        // sₘ/cₘ
        let mut scales = [on.splat(0.0); 2];
        for (scale, RankOne { weight, growth, .. }) in scales.iter_mut().zip(changes) {
            let mut divisor = *weight;
            for weight in divisor.iter_mut().filter(|weight| **weight == 0.0) {
                *weight = f64::INFINITY;
            }
            *scale = on.div(on.add(on.splat(1.0), on.load(growth)), on.load(&divisor));
        }
        let dimension = self.dimension;
        let (before, rest) = self.terms.split_at_mut(self.next);
        let (earlier, rest_deviations) = self.deviations.split_at(self.next * dimension);
        let (own_deviations, later) = rest_deviations.split_at(dimension);
        let mut sum = on.splat(0.0);
        if let [own, after @ ..] = rest {
            for (terms, deviations) in [(before, earlier), (after, later)] {
                let (pairs, last) = terms.as_chunks_mut::<2>();
                let (of_pairs, of_last) = deviations.split_at(2 * pairs.len() * dimension);
                for (pair, u) in pairs.iter_mut().zip(of_pairs.chunks_exact(2 * dimension)) {
                    let (first, second) = u.split_at(dimension);
                    sum = lower(on, pair, [first, second], rows, scales, sum);
                }
                if let [last] = last {
                    let last = std::array::from_mut(last);
                    sum = lower(on, last, [of_last], rows, scales, sum);
                }
            }
            // Of the step itself only the deletion is later than something: the addition.
            let mut projected = on.splat(0.0);
            for (row, u) in rows.iter().zip(own_deviations) {
                projected = on.mul_add(on.load(&u[0]), on.load(&row.gains[1]), projected);
            }
            *own = [Term::of(on, &changes[0]), Term::of(on, &changes[1])];
            sum = own[0].lower_by(on, on.mul(on.mul(projected, projected), scales[1]), sum);
            sum = on.add(sum, on.load(&own[1].excess));
        }
        self.next = if self.next + 1 == self.terms.len() { 0 } else { self.next + 1 };
        let mut result = splat(0.0);
        on.store(&mut result, sum);
        result
    }

    /// Λ of one channel.
    pub(super) fn log_ratio(&self, lane: usize) -> f64 {
        self.terms.as_flattened().iter().map(|term| term.log[lane]).sum()
    }

    /// Λ − T and δ of additions alone, or of deletions alone.
    pub(super) fn part(&self, of_deletions: bool) -> (Lane, Vec<Lane>) {
        let (mut excess, mut shift) = (splat(0.0), vec![splat(0.0); self.dimension]);
        let change = usize::from(of_deletions);
        for (terms, u) in self.terms.iter().zip(self.deviations.chunks_exact(self.dimension)) {
            let term = &terms[change];
            for lane in 0..LANES {
                excess[lane] += term.excess[lane];
                for (s, u) in shift.iter_mut().zip(u) {
                    s[lane] += term.mean_share[lane] * u[change][lane];
                }
            }
        }
        (excess, shift)
    }

    /// Recomputes δ of some channels, so that the rounding of many steps does not pile up.
    #[inline(always)]
    pub(super) fn refresh_mean_shift(&mut self, on: impl Instructions, lanes: [bool; LANES]) {
        for (place, shift) in self.shift.iter_mut().enumerate() {
            let mut sum = on.splat(0.0);
            let deviations = self.deviations[place..].iter().step_by(self.dimension);
            for (terms, u) in self.terms.iter().zip(deviations) {
                for (term, u) in terms.iter().zip(u) {
                    sum = on.mul_add(on.load(&term.mean_share), on.load(u), sum);
                }
            }
            let mut fresh = splat(0.0);
            on.store(&mut fresh, sum);
            for lane in (0..LANES).filter(|&lane| lanes[lane]) {
                shift[lane] = fresh[lane];
            }
        }
    }
}

/// Lowers the terms of earlier steps by what the present changes say, and adds them to the sum.
#[inline(always)]
fn lower<I: Instructions, const STEPS: usize>(
    on: I,
    terms: &mut [[Term; 2]; STEPS],
    deviations: [&[[Lane; 2]]; STEPS],
    rows: &[Row],
    scales: [I::Vector; 2],
    mut sum: I::Vector,
) -> I::Vector {
    let deviations = deviations.map(|u| &u[..rows.len()]);
    // uᵢᵀgₘ
    let mut projected = [[[on.splat(0.0); 2]; 2]; STEPS];
    for (place, row) in rows.iter().enumerate() {
        let gains = [on.load(&row.gains[0]), on.load(&row.gains[1])];
        for step in 0..STEPS {
            for change in 0..2 {
                let u = on.load(&deviations[step][place][change]);
                for later in 0..2 {
                    let product = &mut projected[step][change][later];
                    *product = on.mul_add(u, gains[later], *product);
                }
            }
        }
    }
    for (terms, projected) in terms.iter_mut().zip(projected) {
        for (term, [by_addition, by_deletion]) in terms.iter_mut().zip(projected) {
            let by = on.mul(on.mul(by_addition, by_addition), scales[0]);
            let by = on.mul_add(on.mul(by_deletion, by_deletion), scales[1], by);
            sum = term.lower_by(on, by, sum);
        }
    }
    sum
}

impl Term {
    /// Adds c·`by` to what lowers the term, and the term to the sum.
    #[inline(always)]
    fn lower_by<I: Instructions>(&mut self, on: I, by: I::Vector, sum: I::Vector) -> I::Vector {
        let excess = on.mul_add(on.load(&self.weight), by, on.load(&self.excess));
        on.store(&mut self.excess, excess);
        on.add(sum, excess)
    }

    /// The term of a change right after it. With g = s − 1 and z = g/(2 + g), ln s = 2·atanh z and
    /// h = z·(1 − 1/s) + 2·(atanh z − z). This form does not cancel. For |g| ≤ 1/4, eight terms of the series of atanh
    /// give h to a relative error below 3e-16.
    #[inline(always)]
    fn of(on: impl Instructions, change: &RankOne) -> Term {
        const LARGEST: f64 = 0.25;
        const SERIES: [f64; 8] = [
            2.0 / 17.0,
            2.0 / 15.0,
            2.0 / 13.0,
            2.0 / 11.0,
            2.0 / 9.0,
            2.0 / 7.0,
            2.0 / 5.0,
            2.0 / 3.0,
        ];
        let RankOne { weight, mean_share, growth, shrinkage } = *change;
        let g = on.load(&growth);
        let settled = on.mul(g, on.load(&shrinkage));
        let z = on.div(g, on.add(on.splat(2.0), g));
        let square = on.mul(z, z);
        let mut series = on.splat(0.0);
        for coefficient in SERIES {
            series = on.mul_add(series, square, on.splat(coefficient));
        }
        let excess = on.mul(z, on.mul_add(series, square, settled));
        let mut term = Term { weight, mean_share, ..NOTHING };
        on.store(&mut term.excess, excess);
        on.store(&mut term.log, on.add(excess, settled));
        for lane in 0..LANES {
            if growth[lane].is_nan() || growth[lane].abs() > LARGEST {
                term.log[lane] = libm::log1p(growth[lane]);
                term.excess[lane] = term.log[lane] - growth[lane] * shrinkage[lane];
            }
        }
        term
    }
}
