//! The mean and the scatter of a set of vectors, kept in a form that can be added to and deleted
//! from (eq. 16–18, 20–22 with the corrections of the design); four channels side by side.
//!
//! With scatter C (prior ε·I), mean m and count n:
//!
//! - add r: u = r − m, c = n/(n+1), m += u/(n+1), n += 1, C += c·u·uᵀ
//! - delete q: u = q − m, c = −n/(n−1), m −= u/(n−1), n −= 1, C += c·u·uᵀ
//!
//! The paper updates C⁻¹ itself (Sherman–Morrison). Here its triangular factors are updated instead:
//! C⁻¹ = Kᵀ·D⁻¹·K with K unit lower triangular and D diagonal. The rounding error of a factor grows
//! with the *square root* of the condition number of C, which is what keeps the divergence right to
//! nine digits on smooth residuals; the cost stays O(w²). With p = K·u and
//!
//! - t₀ = 1, tⱼ = tⱼ₋₁ + c·pⱼ²/dⱼ (so that t_w = s = 1 + c·uᵀC⁻¹u of the determinant lemma),
//! - dⱼ ← dⱼ·tⱼ/tⱼ₋₁, βⱼ = c·pⱼ/(dⱼ·tⱼ) with the old dⱼ,
//! - row r of K ← row r − p_r·S_r with S_r = Σ_{j<r} βⱼ·(new row j),
//!
//! S_w comes out as the gain c·C⁻¹u with the new C. (Gill, Golub, Murray, Saunders: Methods for
//! modifying matrix factorizations, 1974, written for the inverse factor; Bierman's U-D filter of
//! 1977 has the same shape.)
//!
//! A change of weight 0 is the identity, bit for bit: that is how a single channel sits a step out.

use super::lanes::{Instructions, LANES, Lane, splat};

/// A rank-one change that the scatter went through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RankOne {
    /// Weight c: positive for an addition, negative for a deletion, 0 for no effect on the scatter.
    pub(super) weight: Lane,
    /// s − 1 = c·uᵀC⁻¹u, with C before the change. At or below −1 the scatter is lost.
    pub(super) growth: Lane,
    /// The share of u by which the mean moved.
    pub(super) mean_share: Lane,
}

/// Mean and factored inverse scatter of the vectors added and not yet deleted.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct Accumulator {
    count: Lane,
    /// Subtracted from every vector first: keeps a large constant offset out of the rounding.
    origin: Lane,
    /// Mean of the vectors, relative to the origin.
    mean: Vec<Lane>,
    /// K left of its unit diagonal, row after row.
    factor: Vec<Lane>,
    /// Diagonal of D.
    diagonal: Vec<Lane>,
    /// u of the latest change.
    deviation: Vec<Lane>,
    /// S_w of the latest change.
    gain: Vec<Lane>,
}

impl Accumulator {
    /// Empty sets of vectors of `dimension` elements with scatter `prior_scatter`·I.
    pub(super) fn new(dimension: usize, prior_scatter: Lane) -> Self {
        let zeros = vec![splat(0.0); dimension];
        Self {
            count: splat(0.0),
            origin: splat(0.0),
            mean: zeros.clone(),
            factor: vec![splat(0.0); dimension * (dimension - 1) / 2],
            diagonal: vec![prior_scatter; dimension],
            deviation: zeros.clone(),
            gain: zeros,
        }
    }

    /// Forgets every vector of one channel; later ones are taken relative to `origin`. Returns how
    /// many numbers were written.
    pub(super) fn clear(&mut self, lane: usize, prior_scatter: f64, origin: f64) -> usize {
        self.count[lane] = 0.0;
        self.origin[lane] = origin;
        let zeroed = [&mut self.mean, &mut self.factor, &mut self.gain, &mut self.deviation];
        zeroed.into_iter().flatten().for_each(|x| x[lane] = 0.0);
        self.diagonal.iter_mut().for_each(|d| d[lane] = prior_scatter);
        self.factor.len() + 4 * self.mean.len()
    }

    /// Exchanges one channel's vectors with those held by `other`. Returns how many numbers changed
    /// places.
    pub(super) fn swap_lane(&mut self, other: &mut Accumulator, lane: usize) -> usize {
        std::mem::swap(&mut self.count[lane], &mut other.count[lane]);
        std::mem::swap(&mut self.origin[lane], &mut other.origin[lane]);
        let pairs = [
            (&mut self.mean, &mut other.mean),
            (&mut self.factor, &mut other.factor),
            (&mut self.diagonal, &mut other.diagonal),
        ];
        for (mine, theirs) in pairs {
            for (a, b) in mine.iter_mut().zip(theirs) {
                std::mem::swap(&mut a[lane], &mut b[lane]);
            }
        }
        self.factor.len() + 2 * self.mean.len()
    }

    /// Number of vectors held by each channel.
    pub(super) fn count(&self) -> Lane {
        self.count
    }

    /// u of the latest change.
    pub(super) fn deviation(&self) -> &[Lane] {
        &self.deviation
    }

    /// c·C⁻¹u of the latest change, with C after it.
    pub(super) fn gain(&self) -> &[Lane] {
        &self.gain
    }

    /// Adds a vector to the channels with `taking` 1 and to none with `taking` 0.
    #[inline(always)]
    pub(super) fn add(&mut self, on: impl Instructions, vector: &[Lane], taking: Lane) -> RankOne {
        let mut weight = splat(0.0);
        let mut share = splat(0.0);
        for lane in (0..LANES).filter(|&lane| taking[lane] > 0.0) {
            let after = self.count[lane] + 1.0;
            weight[lane] = self.count[lane] / after;
            share[lane] = 1.0 / after;
            self.count[lane] = after;
        }
        self.change(on, vector, weight, share)
    }

    /// Deletes a vector, added before, from the channels with `taking` 1.
    #[inline(always)]
    pub(super) fn delete(
        &mut self,
        on: impl Instructions,
        vector: &[Lane],
        taking: Lane,
    ) -> RankOne {
        let mut weight = splat(0.0);
        let mut share = splat(0.0);
        for lane in (0..LANES).filter(|&lane| taking[lane] > 0.0) {
            let after = self.count[lane] - 1.0;
            weight[lane] = -self.count[lane] / after;
            share[lane] = -1.0 / after;
            self.count[lane] = after;
        }
        self.change(on, vector, weight, share)
    }

    /// xᵀC⁻¹x.
    #[inline(always)]
    pub(super) fn quadratic_form(&self, on: impl Instructions, x: &[Lane]) -> Lane {
        let mut sum = on.splat(0.0);
        let mut rest = self.factor.as_slice();
        for (row, d) in self.diagonal.iter().enumerate() {
            let (left, below) = rest.split_at(row);
            rest = below;
            let projected = on.add(on.load(&x[row]), on.dot(left, &x[..row]));
            sum = on.add(sum, on.div(on.mul(projected, projected), on.load(d)));
        }
        let mut result = splat(0.0);
        on.store(&mut result, sum);
        result
    }

    #[inline(always)]
    fn change(
        &mut self,
        on: impl Instructions,
        vector: &[Lane],
        weight: Lane,
        mean_share: Lane,
    ) -> RankOne {
        let origin = on.load(&self.origin);
        for ((u, x), m) in self.deviation.iter_mut().zip(vector).zip(&self.mean) {
            on.store(u, on.sub(on.sub(on.load(x), origin), on.load(m)));
        }
        on.add_scaled(&mut self.mean, on.load(&mean_share), &self.deviation);
        RankOne { weight, growth: self.rotate(on, weight), mean_share }
    }

    /// Carries the factors through C += weight·u·uᵀ and returns s − 1.
    #[inline(always)]
    fn rotate(&mut self, on: impl Instructions, weight: Lane) -> Lane {
        let weight = on.load(&weight);
        let one = on.splat(1.0);
        let mut growth = on.splat(0.0);
        let mut before = one;
        let mut rest = self.factor.as_mut_slice();
        for (row, d) in self.diagonal.iter_mut().enumerate() {
            let (left, below) = rest.split_at_mut(row);
            rest = below;
            let (earlier, gain) = self.gain.split_at_mut(row);
            let projected =
                on.add(on.load(&self.deviation[row]), on.dot(left, &self.deviation[..row]));
            let scaled = on.div(on.mul(weight, projected), on.load(d));
            growth = on.add(growth, on.mul(scaled, projected));
            let after = on.add(one, growth);
            let share = on.div(scaled, after);
            for (k, s) in left.iter_mut().zip(earlier) {
                let sum = on.load(s);
                let entry = on.sub(on.load(k), on.mul(projected, sum));
                on.store(k, entry);
                on.store(s, on.add(sum, on.mul(share, entry)));
            }
            on.store(&mut gain[0], share);
            let widened = on.mul(on.load(d), on.div(after, before));
            on.store(d, widened);
            before = after;
        }
        let mut result = splat(0.0);
        on.store(&mut result, growth);
        result
    }
}
