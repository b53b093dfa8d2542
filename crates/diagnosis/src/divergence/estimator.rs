//! The Kullback–Leibler divergence of residuals' running Gaussians, sample by sample (eq. 15–19).
//!
//! With d = w, δ = m_k − m_{k−l} and ρ = (n_k − 1)/(n_{k−l} − 1),
//!
//! 2·D = [Λ − T] + w·(ρ − 1 − ln ρ) − (ρ − 1)·T + (n_k − 1)·δᵀC_k⁻¹δ
//!
//! where Λ and T are those of [`super::recent`]. In sliding mode with a full interval ρ = 1.
//!
//! Deletions let rounding grow slowly. A second accumulator therefore only adds, from an empty start;
//! once it has seen a whole interval it holds exactly the vectors of the first one and takes its
//! place. Both are fed at every step, so no step does more work than another.

use super::accumulator::Accumulator;
use super::history::History;
use super::lanes::{Instructions, LANES, Lane, Portable, Wide, splat};
use super::recent::RecentChanges;
use super::settings::{DivergenceSettings, Interval};
use super::{DivergenceOutcome, Violation};

/// More negative than rounding explains.
const CLEARLY_NEGATIVE: f64 = -1e-6;

/// Running divergences of four channels that are sampled together.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct EstimatorGroup {
    settings: DivergenceSettings,
    prior_scatter: Lane,
    history: History,
    /// Vectors taken by each channel since its start.
    taken: Lane,
    current: Accumulator,
    fresh: Accumulator,
    recent: RecentChanges,
    #[serde(skip, default = "pulp::Arch::new")]
    instructions: pulp::Arch,
}

/// One push, compiled once for each set of vector instructions.
struct Push<'a> {
    group: &'a mut EstimatorGroup,
    sample: Lane,
}

impl pulp::WithSimd for Push<'_> {
    type Output = [DivergenceOutcome; LANES];

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, instructions: S) -> Self::Output {
        if S::F64_LANES == LANES {
            self.group.push_with(Wide(instructions), self.sample)
        } else {
            self.group.push_with(Portable, self.sample)
        }
    }
}

impl EstimatorGroup {
    /// A group without data. The settings must have been checked.
    pub(super) fn new(settings: DivergenceSettings, prior_scatter: Lane) -> Self {
        let accumulator = Accumulator::new(settings.window, prior_scatter);
        Self {
            prior_scatter,
            history: History::new(settings.window, settings.interval.vectors().unwrap_or(1)),
            taken: splat(0.0),
            fresh: accumulator.clone(),
            current: accumulator,
            recent: RecentChanges::new(settings.window, settings.lag),
            instructions: pulp::Arch::new(),
            settings,
        }
    }

    /// Forgets all data.
    pub(super) fn restart(&mut self) {
        self.history.clear();
        self.recent.rewind();
        (0..LANES).for_each(|lane| self.restart_lane(lane));
    }

    /// Notes that samples are missing before the next one: no window is formed across the gap.
    pub(super) fn gap(&mut self) {
        self.history.gap();
    }

    /// Takes the next sample of each channel; all must be finite.
    pub(super) fn push(&mut self, sample: Lane) -> [DivergenceOutcome; LANES] {
        self.instructions.dispatch(Push { group: self, sample })
    }

    #[inline(always)]
    fn push_with(&mut self, on: impl Instructions, sample: Lane) -> [DivergenceOutcome; LANES] {
        self.history.push(sample);
        if !self.take_vector(on) {
            return [DivergenceOutcome::Undefined; LANES];
        }
        let divergence = self.divergence(on);
        let mut outcomes = [DivergenceOutcome::Undefined; LANES];
        for (lane, outcome) in outcomes.iter_mut().enumerate() {
            *outcome = self.judge(lane, divergence[lane]);
            if matches!(outcome, DivergenceOutcome::Restarted(_)) {
                self.restart_lane(lane);
            }
        }
        outcomes
    }

    /// Forgets one channel's data; it restarts with the next vector.
    pub(super) fn restart_lane(&mut self, lane: usize) {
        self.taken[lane] = 0.0;
        self.recent.clear(lane);
    }

    /// Moves both accumulators on by the newest vector, if the newest samples form one.
    #[inline(always)]
    fn take_vector(&mut self, on: impl Instructions) -> bool {
        let Some(newest) = self.history.newest_vector() else {
            return false;
        };
        for lane in (0..LANES).filter(|&lane| self.taken[lane] == 0.0) {
            on.moved(self.current.clear(lane, self.prior_scatter[lane], newest[0][lane]));
            on.moved(self.fresh.clear(lane, self.prior_scatter[lane], newest[0][lane]));
        }
        self.taken.iter_mut().for_each(|taken| *taken += 1.0);
        let added = self.current.add(on, newest, splat(1.0));
        self.recent.push(on, added, self.current.deviation(), self.current.gain());
        match self.settings.interval {
            Interval::Sliding { vectors } => self.slide(on, vectors as f64),
            Interval::Growing => self.recent.push_nothing(on),
        }
        true
    }

    /// Deletes the oldest vector if the interval is too full, and updates the successor. The history advances
    /// independently of the channels, each of which may have restarted at a different time.
    #[inline(always)]
    fn slide(&mut self, on: impl Instructions, interval: f64) {
        if self.history.held() as f64 <= interval {
            self.recent.push_nothing(on);
            return;
        }
        let over_full = self.current.count().map(|n| f64::from(n > interval));
        match self.history.oldest_vector() {
            Some(oldest) => {
                let deleted = self.current.delete(on, oldest, over_full);
                self.recent.push(on, deleted, self.current.deviation(), self.current.gain());
                self.history.delete_oldest();
            }
            None => {
                self.history.clear();
                self.taken = splat(f64::NAN);
                return;
            }
        }
        let Some(newest) = self.history.newest_vector() else {
            return;
        };
        let origin = newest[0];
        self.fresh.add(on, newest, over_full);
        let complete = self.fresh.count();
        for lane in (0..LANES).filter(|&lane| complete[lane] >= interval) {
            on.moved(2 * self.current.swap_lane(&mut self.fresh, lane));
            on.moved(self.fresh.clear(lane, self.prior_scatter[lane], origin[lane]));
            on.moved(self.recent.refresh_mean_shift(lane));
        }
    }

    /// D of each channel; meaningless where fewer than two vectors lie in either Gaussian.
    #[inline(always)]
    fn divergence(&mut self, on: impl Instructions) -> Lane {
        let (excess, trace_loss) = self.recent.excess_and_trace_loss();
        let count = self.current.count();
        let distance = self.current.quadratic_form(on, self.recent.mean_shift());
        let mut divergence = splat(0.0);
        for lane in 0..LANES {
            let earlier = self.earlier_count(lane);
            let widening = (count[lane] - earlier) / (earlier - 1.0);
            let scale_term = if widening == 0.0 {
                0.0
            } else {
                self.settings.window as f64 * (widening - libm::log1p(widening))
                    - widening * trace_loss[lane]
            };
            let mean_term = (count[lane] - 1.0) * distance[lane];
            divergence[lane] = 0.5 * (excess[lane] + scale_term + mean_term);
        }
        divergence
    }

    /// How much of a channel's divergence comes of the vectors that were added within the lag, and how much of those that
    /// were deleted. Their sum is not the divergence, for the two have terms in common.
    pub(super) fn parts(&self, lane: usize) -> [f64; 2] {
        [false, true].map(|of_deletions| {
            let (excess, shift) = self.recent.part(of_deletions);
            let distance = self.current.quadratic_form(Portable, &shift)[lane];
            0.5 * (excess[lane] + (self.current.count()[lane] - 1.0) * distance)
        })
    }

    /// n_{k−l}: how many vectors the Gaussian held l steps ago; below 0 if there was none.
    #[inline(always)]
    fn earlier_count(&self, lane: usize) -> f64 {
        (self.taken[lane] - self.settings.lag as f64).min(self.current.count()[lane])
    }

    #[inline(always)]
    fn judge(&self, lane: usize, divergence: f64) -> DivergenceOutcome {
        let earlier = self.earlier_count(lane);
        if self.taken[lane].is_nan() {
            DivergenceOutcome::Restarted(Violation::TooManyGaps)
        } else if earlier < 2.0 {
            DivergenceOutcome::Undefined
        } else if !divergence.is_finite() {
            DivergenceOutcome::Restarted(Violation::ScatterLost)
        } else if divergence < CLEARLY_NEGATIVE {
            DivergenceOutcome::Restarted(Violation::NegativeDivergence)
        } else {
            DivergenceOutcome::Defined {
                divergence: divergence.max(0.0),
                age: self.taken[lane] as u64,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    const SETTINGS: DivergenceSettings =
        DivergenceSettings { window: 10, lag: 10, interval: Interval::Sliding { vectors: 300 } };

    /// Plain arithmetic that counts its operations.
    #[derive(Clone, Copy)]
    struct Counting<'a>(&'a Cell<u64>);

    impl Counting<'_> {
        fn count(self) {
            self.0.set(self.0.get() + 1);
        }
    }

    impl Instructions for Counting<'_> {
        type Vector = Lane;

        fn load(self, lane: &Lane) -> Lane {
            Portable.load(lane)
        }

        fn store(self, lane: &mut Lane, vector: Lane) {
            self.count();
            Portable.store(lane, vector);
        }

        fn add(self, a: Lane, b: Lane) -> Lane {
            self.count();
            Portable.add(a, b)
        }

        fn sub(self, a: Lane, b: Lane) -> Lane {
            self.count();
            Portable.sub(a, b)
        }

        fn mul(self, a: Lane, b: Lane) -> Lane {
            self.count();
            Portable.mul(a, b)
        }

        fn div(self, a: Lane, b: Lane) -> Lane {
            self.count();
            Portable.div(a, b)
        }

        fn moved(self, numbers: usize) {
            self.0.set(self.0.get() + numbers as u64);
        }
    }

    /// A deterministic series with some life in it.
    fn sample(k: u32) -> Lane {
        let x = f64::from(k);
        [(0.1 * x).sin(), (0.37 * x).sin() + 0.01 * x.sqrt(), f64::from(k % 17), 1.0 / (1.0 + x)]
    }

    #[test]
    fn no_step_does_more_than_twice_the_work_of_the_median_step() {
        let operations = Cell::new(0);
        let mut group = EstimatorGroup::new(SETTINGS, splat(1e-4));
        let mut work: Vec<u64> = (0..3000)
            .map(|k| {
                operations.set(0);
                group.push_with(Counting(&operations), sample(k));
                operations.get()
            })
            .collect();
        let largest = work.iter().copied().max().unwrap();
        work.sort_unstable();
        let median = work[work.len() / 2];
        println!("median {median} operations, largest {largest}");
        assert!(median > 1000, "the counter counts: {median}");
        assert!(largest <= 2 * median, "{largest} against a median of {median}");
    }

    #[test]
    fn the_machines_vector_instructions_give_the_same_bits_as_plain_arithmetic() {
        let mut plain = EstimatorGroup::new(SETTINGS, splat(1e-4));
        let mut wide = plain.clone();
        for k in 0..2000 {
            assert_eq!(plain.push_with(Portable, sample(k)), wide.push(sample(k)), "step {k}");
        }
    }

    #[test]
    fn a_restarted_channel_is_as_one_that_begins_then_whatever_the_others_do() {
        let settings =
            DivergenceSettings { window: 5, lag: 4, interval: Interval::Sliding { vectors: 60 } };
        // Multiples of the interval, and what is near, at and beyond them.
        let times = [0, 1, 17, 59, 60, 61, 72, 130];
        let mut number = 1_u32;
        for round in 0..60 {
            let restarts: [u32; LANES] = std::array::from_fn(|_| {
                number = number.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                100 + times[(number >> 20) as usize % times.len()] + round % 3
            });
            let gap = (round % 4 == 0).then_some(300 + round);
            let mut shared = EstimatorGroup::new(settings, splat(1e-4));
            let mut alone: [EstimatorGroup; LANES] =
                std::array::from_fn(|_| EstimatorGroup::new(settings, splat(1e-4)));
            for k in 0..500 {
                for lane in (0..LANES).filter(|&lane| restarts[lane] == k) {
                    shared.restart_lane(lane);
                    alone[lane].restart();
                    // The window goes on, as the samples do.
                    for before in k - 4..k {
                        let _ = alone[lane].push(sample(before));
                    }
                    alone[lane].restart_lane(lane);
                }
                if gap == Some(k) {
                    shared.gap();
                    alone.iter_mut().for_each(EstimatorGroup::gap);
                }
                let outcomes = shared.push(sample(k));
                for lane in 0..LANES {
                    let expected = alone[lane].push(sample(k))[lane];
                    match (outcomes[lane].divergence(), expected.divergence()) {
                        (Some(a), Some(b)) => {
                            assert!((a - b).abs() <= 1e-9 * (1.0 + b), "{k} {lane}: {a} {b}");
                        }
                        (a, b) => assert_eq!(a, b, "step {k}, channel {lane}"),
                    }
                }
            }
        }
    }

    #[test]
    fn a_channel_that_is_lost_comes_back_and_leaves_the_others_alone() {
        let mut hit = EstimatorGroup::new(SETTINGS, splat(1e-4));
        let mut spared = hit.clone();
        let mut restarts = 0;
        for k in 0..2000 {
            let mut disturbed = sample(k);
            if k == 700 {
                disturbed[1] = 1e200;
            }
            let (a, b) = (hit.push(disturbed), spared.push(sample(k)));
            restarts += u32::from(matches!(a[1], DivergenceOutcome::Restarted(_)));
            assert_eq!((a[0], a[2], a[3]), (b[0], b[2], b[3]));
        }
        assert!(restarts >= 1);
        assert!(hit.push(sample(2000))[1].divergence().is_some());
    }
}
