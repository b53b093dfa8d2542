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
//! Two changes need K but twice: K·x of everything that is asked for, before, and all its entries, after. In between,
//! K·x is carried through a change without K, because (new row r)·x = (row r)·x − p_r·(S_r·x) and S_r·x is the sum of
//! βⱼ·(new row j)·x over the rows before. So are the second change's p and, for xᵀC⁻¹x, K·x after both. 1/dⱼ is kept
//! instead of dⱼ: one division a row and change.
//!
//! A change of weight 0 is the identity, bit for bit: that is how a single channel sits a step out.

use super::lanes::{Instructions, LANES, Lane, splat};

/// From here on the product of two s may overflow: the scatter counts as lost.
const LARGEST_GROWTH: f64 = 1e150;

/// A rank-one change that the scatter went through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RankOne {
    /// Weight c: positive for an addition, negative for a deletion, 0 for no effect on the scatter.
    pub(super) weight: Lane,
    /// The share of u by which the mean moved.
    pub(super) mean_share: Lane,
    /// s − 1 = c·uᵀC⁻¹u, with C before the change. At or below −1 the scatter is lost.
    pub(super) growth: Lane,
    /// 1/s.
    pub(super) shrinkage: Lane,
}

impl RankOne {
    /// No change at all.
    pub(super) const NONE: RankOne = RankOne {
        weight: splat(0.0),
        mean_share: splat(0.0),
        growth: splat(0.0),
        shrinkage: splat(1.0),
    };
}

/// What belongs to one row of K while the scatter changes.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Row {
    /// An element of K·u of each change, and of K·x.
    projected: [Lane; 3],
    /// βⱼ of each change.
    shares: [Lane; 2],
    /// An element of c·C⁻¹u of each change, with C after it.
    pub(super) gains: [Lane; 2],
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
    /// Diagonal of D⁻¹.
    inverse_diagonal: Vec<Lane>,
}

impl Accumulator {
    /// Empty sets of vectors of `dimension` elements with scatter `prior_scatter`·I.
    pub(super) fn new(dimension: usize, prior_scatter: Lane) -> Self {
        Self {
            count: splat(0.0),
            origin: splat(0.0),
            mean: vec![splat(0.0); dimension],
            factor: vec![splat(0.0); dimension * (dimension - 1) / 2],
            inverse_diagonal: vec![prior_scatter.map(f64::recip); dimension],
        }
    }

    /// Forgets every vector of one channel; later ones are taken relative to `origin`. Returns how
    /// many numbers were written.
    pub(super) fn clear(&mut self, lane: usize, prior_scatter: f64, origin: f64) -> usize {
        self.count[lane] = 0.0;
        self.origin[lane] = origin;
        [&mut self.mean, &mut self.factor].into_iter().flatten().for_each(|x| x[lane] = 0.0);
        self.inverse_diagonal.iter_mut().for_each(|d| d[lane] = prior_scatter.recip());
        self.factor.len() + 2 * self.mean.len()
    }

    /// Exchanges the vectors of some channels with those held by `other`. Returns how many numbers changed
    /// places.
    pub(super) fn swap_lanes(&mut self, other: &mut Accumulator, lanes: [bool; LANES]) -> usize {
        if lanes == [true; LANES] {
            std::mem::swap(self, other);
            return 0;
        }
        let pairs = [
            (std::slice::from_mut(&mut self.count), std::slice::from_mut(&mut other.count)),
            (std::slice::from_mut(&mut self.origin), std::slice::from_mut(&mut other.origin)),
            (&mut self.mean, &mut other.mean),
            (&mut self.factor, &mut other.factor),
            (&mut self.inverse_diagonal, &mut other.inverse_diagonal),
        ];
        let mut moved = 0;
        for (mine, theirs) in pairs {
            for lane in (0..LANES).filter(|&lane| lanes[lane]) {
                mine.iter_mut().zip(&mut *theirs).for_each(|(a, b)| {
                    std::mem::swap(&mut a[lane], &mut b[lane]);
                });
                moved += 2 * mine.len();
            }
        }
        moved
    }

    /// Number of vectors held by each channel.
    pub(super) fn count(&self) -> Lane {
        self.count
    }

    /// Counts a vector that is added to the channels with `taking` 1 and to none with `taking` 0; then one that is
    /// deleted in the same way, if there are two. Mean and scatter have yet to follow.
    #[inline(always)]
    pub(super) fn count_changes<const CHANGES: usize>(
        &mut self,
        taking: [Lane; CHANGES],
    ) -> [RankOne; CHANGES] {
        let mut changes = [RankOne::NONE; CHANGES];
        for (change, sign) in [1.0, -1.0].into_iter().enumerate().take(CHANGES) {
            let RankOne { weight, mean_share, .. } = &mut changes[change];
            for lane in 0..LANES {
                let (before, moved) = (self.count[lane], sign * taking[change][lane]);
                self.count[lane] = before + moved;
                mean_share[lane] = moved / self.count[lane].max(1.0);
                weight[lane] = before * mean_share[lane];
            }
        }
        changes
    }

    /// Moves an element of the mean by those of the changes' vectors, and returns the elements of their u.
    #[inline(always)]
    pub(super) fn move_mean<I: Instructions, const CHANGES: usize>(
        &mut self,
        on: I,
        place: usize,
        elements: [&Lane; CHANGES],
        shares: [I::Vector; CHANGES],
    ) -> [I::Vector; CHANGES] {
        let origin = on.load(&self.origin);
        let mut moved = on.load(&self.mean[place]);
        let mut deviations = shares;
        for change in 0..CHANGES {
            deviations[change] = on.sub(on.sub(on.load(elements[change]), origin), moved);
            moved = on.mul_add(shares[change], deviations[change], moved);
        }
        on.store(&mut self.mean[place], moved);
        deviations
    }

    /// xᵀC⁻¹x.
    pub(super) fn quadratic_form(&self, x: &[Lane]) -> Lane {
        let mut sum = splat(0.0);
        let mut rest = self.factor.as_slice();
        for (row, inverse) in self.inverse_diagonal.iter().enumerate() {
            let (left, below) = rest.split_at(row);
            rest = below;
            for lane in 0..LANES {
                let dot: f64 = left.iter().zip(x).map(|(k, x)| k[lane] * x[lane]).sum();
                let projected = x[row][lane] + dot;
                sum[lane] += projected * projected * inverse[lane];
            }
        }
        sum
    }

    /// Carries the factors through the changes with the given u, one after the other, completes what they say of s, and
    /// writes their gains. Returns xᵀC⁻¹x with C after all of them if `VECTORS` is one more than the number of changes.
    #[inline(always)]
    pub(super) fn change<const CHANGES: usize, const VECTORS: usize>(
        &mut self,
        on: impl Instructions,
        changes: &mut [RankOne; CHANGES],
        deviations: &[[Lane; 2]],
        x: &[Lane],
        rows: &mut [Row],
    ) -> Lane {
        let vectors = Vectors::<CHANGES> { deviations, x };
        project::<_, CHANGES, VECTORS>(on, &self.factor, vectors, rows);
        let form = carry::<CHANGES, VECTORS>(on, &mut self.inverse_diagonal, changes, rows);
        rewrite::<CHANGES>(on, &mut self.factor, rows);
        form
    }
}

/// What K is multiplied with: u of each change, then x.
#[derive(Clone, Copy)]
struct Vectors<'a, const CHANGES: usize> {
    deviations: &'a [[Lane; 2]],
    x: &'a [Lane],
}

impl<const CHANGES: usize> Vectors<'_, CHANGES> {
    #[inline(always)]
    fn load<I: Instructions, const VECTORS: usize>(
        self,
        on: I,
        place: usize,
    ) -> [I::Vector; VECTORS] {
        let mut elements = [on.splat(0.0); VECTORS];
        for (vector, element) in elements.iter_mut().enumerate() {
            let lane = match vector {
                _ if vector < CHANGES => &self.deviations[place][vector],
                _ => &self.x[place],
            };
            *element = on.load(lane);
        }
        elements
    }
}

/// The first numbers of some, in registers. (A closure, as of `array::from_fn`, would not have the instructions.)
#[inline(always)]
fn load<I: Instructions, const N: usize>(on: I, lanes: &[Lane]) -> [I::Vector; N] {
    let mut vectors = [on.splat(0.0); N];
    for (vector, lane) in vectors.iter_mut().zip(lanes) {
        *vector = on.load(lane);
    }
    vectors
}

/// K·x of the vectors. Two rows of K at a time: what is loaded serves both.
#[inline(always)]
fn project<I: Instructions, const CHANGES: usize, const VECTORS: usize>(
    on: I,
    factor: &[Lane],
    vectors: Vectors<CHANGES>,
    rows: &mut [Row],
) {
    let (deviations, x) = (&vectors.deviations[..rows.len()], &vectors.x[..rows.len()]);
    let vectors = Vectors::<CHANGES> { deviations, x };
    let mut rest = factor;
    for (pair, rows) in rows.chunks_mut(2).enumerate() {
        let place = 2 * pair;
        let (upper, below) = rest.split_at(place);
        if let [first, second] = rows {
            let (lower, below) = below.split_at(place + 1);
            rest = below;
            let mut of_first: [I::Vector; VECTORS] = vectors.load(on, place);
            let mut of_second: [I::Vector; VECTORS] = vectors.load(on, place + 1);
            let corner = on.load(&lower[place]);
            for v in 0..VECTORS {
                of_second[v] = on.mul_add(corner, of_first[v], of_second[v]);
            }
            for (place, (a, b)) in upper.iter().zip(lower).enumerate() {
                let (a, b) = (on.load(a), on.load(b));
                let elements: [I::Vector; VECTORS] = vectors.load(on, place);
                for v in 0..VECTORS {
                    of_first[v] = on.mul_add(a, elements[v], of_first[v]);
                    of_second[v] = on.mul_add(b, elements[v], of_second[v]);
                }
            }
            for v in 0..VECTORS {
                on.store(&mut first.projected[v], of_first[v]);
                on.store(&mut second.projected[v], of_second[v]);
            }
        } else if let [last] = rows {
            let mut sums: [I::Vector; VECTORS] = vectors.load(on, place);
            for (place, k) in upper.iter().enumerate() {
                let elements: [I::Vector; VECTORS] = vectors.load(on, place);
                for (sum, element) in sums.iter_mut().zip(elements) {
                    *sum = on.mul_add(on.load(k), element, *sum);
                }
            }
            for (projected, sum) in last.projected.iter_mut().zip(sums) {
                on.store(projected, sum);
            }
        }
    }
}

/// Carries D⁻¹ and each K·x through the changes, and finds their β and s.
#[inline(always)]
fn carry<const CHANGES: usize, const VECTORS: usize>(
    on: impl Instructions,
    inverse_diagonal: &mut [Lane],
    changes: &mut [RankOne; CHANGES],
    rows: &mut [Row],
) -> Lane {
    // Change by change, not row by row: within a change little waits for the row before.
    for (number, change) in changes.iter_mut().enumerate() {
        match number {
            0 => Passage::<_, 0, VECTORS>::through(on, inverse_diagonal, change, rows),
            _ => Passage::<_, 1, VECTORS>::through(on, inverse_diagonal, change, rows),
        }
    }
    let mut form = on.splat(0.0);
    if VECTORS > CHANGES {
        for (row, inverse) in rows.iter().zip(&*inverse_diagonal) {
            let p = on.load(&row.projected[CHANGES]);
            form = on.mul_add(on.mul(p, p), on.load(inverse), form);
        }
    }
    let mut result = splat(0.0);
    on.store(&mut result, form);
    for change in changes {
        for lane in (0..LANES).filter(|&lane| change.growth[lane] > LARGEST_GROWTH) {
            inverse_diagonal[0][lane] = f64::NAN;
            result[lane] = f64::NAN;
        }
    }
    result
}

/// How a change has gone up to a row.
struct Passage<V, const NUMBER: usize, const VECTORS: usize> {
    weight: V,
    growth: V,
    s: V,
    shrinkage: V,
    /// S_r·x of the later vectors.
    carried: [V; VECTORS],
}

impl<V: Copy, const NUMBER: usize, const VECTORS: usize> Passage<V, NUMBER, VECTORS> {
    /// Through all rows.
    #[inline(always)]
    fn through<I: Instructions<Vector = V>>(
        on: I,
        inverse_diagonal: &mut [Lane],
        change: &mut RankOne,
        rows: &mut [Row],
    ) {
        let (zero, one) = (on.splat(0.0), on.splat(1.0));
        let weight = on.load(&change.weight);
        let (growth, carried) = (zero, [zero; VECTORS]);
        let mut passage = Self { weight, growth, s: one, shrinkage: one, carried };
        let (pairs, last) = rows.as_chunks_mut::<2>();
        let (inverses, last_inverse) = inverse_diagonal.as_chunks_mut::<2>();
        for (rows, inverses) in pairs.iter_mut().zip(inverses) {
            passage.pass(on, inverses, rows);
        }
        if let ([row], [inverse]) = (last, last_inverse) {
            passage.pass(on, std::array::from_mut(inverse), std::array::from_mut(row));
        }
        on.store(&mut change.growth, passage.growth);
        on.store(&mut change.shrinkage, passage.shrinkage);
    }

    /// Through one row, or through two, of which the product of both s is inverted at once.
    #[inline(always)]
    fn pass<I: Instructions<Vector = V>, const ROWS: usize>(
        &mut self,
        on: I,
        inverses: &mut [Lane; ROWS],
        rows: &mut [Row; ROWS],
    ) {
        let one = on.splat(1.0);
        let (mut scaled, mut after, mut shrinkages) = ([one; ROWS], [one; ROWS], [one; ROWS]);
        for row in 0..ROWS {
            let p = on.load(&rows[row].projected[NUMBER]);
            scaled[row] = on.mul(self.weight, on.mul(p, on.load(&inverses[row])));
            self.growth = on.mul_add(scaled[row], p, self.growth);
            after[row] = on.add(one, self.growth);
        }
        if ROWS == 2 {
            let both = on.div(one, on.mul(after[0], after[1]));
            shrinkages[0] = on.mul(both, after[1]);
            shrinkages[1] = on.mul(both, after[0]);
        } else {
            shrinkages[0] = on.div(one, after[0]);
        }
        for row in 0..ROWS {
            let p = on.load(&rows[row].projected[NUMBER]);
            let share = on.mul(scaled[row], shrinkages[row]);
            let kept = on.mul(self.s, shrinkages[row]);
            (self.s, self.shrinkage) = (after[row], shrinkages[row]);
            let inverse = on.mul(on.load(&inverses[row]), kept);
            on.store(&mut inverses[row], inverse);
            on.store(&mut rows[row].shares[NUMBER], share);
            for v in NUMBER + 1..VECTORS {
                let x = on.load(&rows[row].projected[v]);
                let projected = on.sub_mul(x, p, self.carried[v]);
                on.store(&mut rows[row].projected[v], projected);
                self.carried[v] = on.mul_add(kept, self.carried[v], on.mul(share, x));
            }
        }
    }
}

/// Rewrites the rows of K, two at a time, and leaves S_w in the gains.
#[inline(always)]
fn rewrite<const CHANGES: usize>(on: impl Instructions, factor: &mut [Lane], rows: &mut [Row]) {
    let mut rest = factor;
    for place in (0..rows.len()).step_by(2) {
        let (earlier, own) = rows.split_at_mut(place);
        let (upper, below) = rest.split_at_mut(place);
        if let [first, second, ..] = own {
            let (lower, below) = below.split_at_mut(place + 1);
            rest = below;
            let (lower, corner) = lower.split_at_mut(place);
            let p = [load::<_, CHANGES>(on, &first.projected), load(on, &second.projected)];
            let shares = [load::<_, CHANGES>(on, &first.shares), load(on, &second.shares)];
            for ((a, b), row) in upper.iter_mut().zip(&mut *lower).zip(earlier) {
                let (mut k, mut l) = (on.load(a), on.load(b));
                for change in 0..CHANGES {
                    let mut sum = on.load(&row.gains[change]);
                    k = on.sub_mul(k, p[0][change], sum);
                    sum = on.mul_add(shares[0][change], k, sum);
                    l = on.sub_mul(l, p[1][change], sum);
                    sum = on.mul_add(shares[1][change], l, sum);
                    on.store(&mut row.gains[change], sum);
                }
                on.store(a, k);
                on.store(b, l);
            }
            let mut l = on.load(&corner[0]);
            for change in 0..CHANGES {
                let [sum, share] = [shares[0][change], shares[1][change]];
                l = on.sub_mul(l, p[1][change], sum);
                on.store(&mut first.gains[change], on.mul_add(share, l, sum));
                on.store(&mut second.gains[change], share);
            }
            on.store(&mut corner[0], l);
        } else {
            rest = below;
            let Some(last) = own.first_mut() else { return };
            for (a, row) in upper.iter_mut().zip(earlier) {
                let mut k = on.load(a);
                for change in 0..CHANGES {
                    let sum = on.load(&row.gains[change]);
                    k = on.sub_mul(k, on.load(&last.projected[change]), sum);
                    on.store(
                        &mut row.gains[change],
                        on.mul_add(on.load(&last.shares[change]), k, sum),
                    );
                }
                on.store(a, k);
            }
            last.gains = last.shares;
        }
    }
}
