//! The Kullback–Leibler divergence of residuals' running Gaussians, sample by sample (eq. 15–19).
//!
//! With d = w, δ = m_k − m_{k−l} and ρ = (n_k − 1)/(n_{k−l} − 1),
//!
//! 2·D = [Λ − T] + w·(ρ − 1 − ln ρ) − (ρ − 1)·T + (n_k − 1)·δᵀC_k⁻¹δ
//!
//! where Λ and T are those of [`super::recent`]. In sliding mode with a full interval ρ = 1.
//!
//! Deletions let rounding grow slowly: over ten million of them on a smooth residual to 2e-11 of the divergence. A
//! successor is therefore built now and then that only adds, from an empty start; once it has seen a whole interval it
//! holds exactly the vectors of the accumulator and takes its place. It is begun at once after a deletion that cost
//! digits, as that of a large outlier does. A step with it is two fifths more work than one without.

use std::fmt;

use super::accumulator::{Accumulator, Row};
use super::history::History;
use super::lanes::{Instructions, LANES, Lane, Portable, Wide, splat};
use super::recent::RecentChanges;
use super::settings::DivergenceSettings;
use super::{DivergenceOutcome, Violation};

/// More negative than rounding explains.
const CLEARLY_NEGATIVE: f64 = -1e-6;

/// A successor is begun this many intervals after the one before has taken its place.
const REST: f64 = 7.0;

/// A deletion that makes the scatter's determinant smaller by this factor costs digits.
const LOSSY: f64 = 16.0;

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
    /// How many vectors each channel goes on before its successor is begun; 0 while it is built.
    rest: Lane,
    recent: RecentChanges,
    #[serde(skip)]
    scratch: Scratch,
    #[serde(skip, default = "pulp::Arch::new")]
    instructions: pulp::Arch,
}

/// What means nothing from one step to the next.
#[derive(Clone, Default)]
struct Scratch {
    rows: Vec<Row>,
    /// u of the successor's change.
    deviations: Vec<[Lane; 2]>,
}

impl fmt::Debug for Scratch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Scratch")
    }
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
            rest: splat(0.0),
            fresh: accumulator.clone(),
            current: accumulator,
            recent: RecentChanges::new(settings.window, settings.lag),
            scratch: Scratch::default(),
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
        let Some(divergence) = self.take_vector(on) else {
            return [DivergenceOutcome::Undefined; LANES];
        };
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

    /// Moves both accumulators on by the newest vector, if the newest samples form one. Returns D of each channel,
    /// meaningless where fewer than two vectors lie in either Gaussian. The history advances independently of the
    /// channels, each of which may have restarted at a different time.
    #[inline(always)]
    fn take_vector(&mut self, on: impl Instructions) -> Option<Lane> {
        let newest = self.history.newest_vector()?;
        let origin = newest[0];
        for lane in (0..LANES).filter(|&lane| self.taken[lane] == 0.0) {
            self.rest[lane] = REST * self.settings.interval.vectors().unwrap_or(0) as f64;
            on.moved(self.current.clear(lane, self.prior_scatter[lane], origin[lane]));
        }
        self.taken.iter_mut().for_each(|taken| *taken += 1.0);
        self.scratch.rows.resize(self.settings.window, Row::default());
        self.scratch.deviations.resize(self.settings.window, [splat(0.0); 2]);
        let full = self.settings.interval.vectors().map_or(f64::INFINITY, |full| full as f64);
        if self.history.held() as f64 <= full {
            return Some(self.add_only(on));
        }
        let Some(oldest) = self.history.oldest_vector() else {
            self.history.clear();
            self.taken = splat(f64::NAN);
            return Some(splat(f64::NAN));
        };
        let over_full = self.current.count().map(|count| f64::from(count + 1.0 > full));
        let taking = [splat(1.0), over_full];
        let mut changes = self.recent.move_mean(on, &mut self.current, [newest, oldest], taking);
        let (deviations, shift) = (self.recent.latest(), self.recent.mean_shift());
        let distance = self.current.change::<2, 3>(
            on,
            &mut changes,
            deviations,
            shift,
            &mut self.scratch.rows,
        );
        let excess = self.recent.record(on, &changes, &self.scratch.rows);
        let divergence = self.divergence(excess, distance);

        let mut building = splat(0.0);
        for lane in (0..LANES).filter(|&lane| over_full[lane] > 0.0) {
            let rest = &mut self.rest[lane];
            if *rest > 0.0 {
                *rest =
                    if changes[1].shrinkage[lane] > LOSSY { 0.0 } else { (*rest - 1.0).max(0.0) };
                if *rest == 0.0 {
                    on.moved(self.fresh.clear(lane, self.prior_scatter[lane], origin[lane]));
                }
            } else {
                building[lane] = 1.0;
            }
        }
        if building != splat(0.0) {
            self.build_successor(on, building, full);
        }
        self.history.delete_oldest();
        Some(divergence)
    }

    /// The same while the interval is not full.
    #[inline(always)]
    fn add_only(&mut self, on: impl Instructions) -> Lane {
        let Some(newest) = self.history.newest_vector() else { return splat(f64::NAN) };
        let taking = [splat(1.0), splat(0.0)];
        let [added, deleted] =
            self.recent.move_mean(on, &mut self.current, [newest, newest], taking);
        let (deviations, shift) = (self.recent.latest(), self.recent.mean_shift());
        let mut changes = [added];
        let distance = self.current.change::<1, 2>(
            on,
            &mut changes,
            deviations,
            shift,
            &mut self.scratch.rows,
        );
        self.scratch.rows.iter_mut().for_each(|row| row.gains[1] = splat(0.0));
        let excess = self.recent.record(on, &[changes[0], deleted], &self.scratch.rows);
        self.divergence(excess, distance)
    }

    /// Adds the newest vector to the successor of some channels, which takes its place once it has a whole interval.
    #[inline(always)]
    fn build_successor(&mut self, on: impl Instructions, building: Lane, full: f64) {
        let Some(newest) = self.history.newest_vector() else { return };
        let mut changes = self.fresh.count_changes([building]);
        let share = on.load(&changes[0].mean_share);
        for (place, element) in newest.iter().enumerate() {
            let [deviation] = self.fresh.move_mean(on, place, [element], [share]);
            on.store(&mut self.scratch.deviations[place][0], deviation);
        }
        let shift = self.recent.mean_shift();
        let _ = self.fresh.change::<1, 1>(
            on,
            &mut changes,
            &self.scratch.deviations,
            shift,
            &mut self.scratch.rows,
        );
        let count = self.fresh.count();
        let complete = std::array::from_fn(|lane| building[lane] > 0.0 && count[lane] >= full);
        if complete.contains(&true) {
            on.moved(self.current.swap_lanes(&mut self.fresh, complete));
            self.recent.refresh_mean_shift(on, complete);
            for lane in (0..LANES).filter(|&lane| complete[lane]) {
                self.rest[lane] = REST * full;
            }
        }
    }

    /// D of Λ − T and δᵀC_k⁻¹δ.
    #[inline(always)]
    fn divergence(&self, excess: Lane, distance: Lane) -> Lane {
        let count = self.current.count();
        let mut divergence = splat(0.0);
        for lane in 0..LANES {
            let earlier = self.earlier_count(lane);
            let mut sum = excess[lane] + (count[lane] - 1.0) * distance[lane];
            if count[lane] != earlier {
                let widening = (count[lane] - earlier) / (earlier - 1.0);
                let trace_loss = self.recent.log_ratio(lane) - excess[lane];
                sum += self.settings.window as f64 * (widening - libm::log1p(widening))
                    - widening * trace_loss;
            }
            divergence[lane] = 0.5 * sum;
        }
        divergence
    }

    /// How much of a channel's divergence comes of the vectors that were added within the lag, and how much of those that
    /// were deleted. Their sum is not the divergence, for the two have terms in common.
    pub(super) fn parts(&self, lane: usize) -> [f64; 2] {
        [false, true].map(|of_deletions| {
            let (excess, shift) = self.recent.part(of_deletions);
            let distance = self.current.quadratic_form(&shift)[lane];
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
    use crate::divergence::Interval;

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

        fn mul_add(self, a: Lane, b: Lane, c: Lane) -> Lane {
            self.count();
            Portable.mul_add(a, b, c)
        }

        fn sub_mul(self, c: Lane, a: Lane, b: Lane) -> Lane {
            self.count();
            Portable.sub_mul(c, a, b)
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
            for k in 0..1500 {
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
    fn what_an_outlier_cost_is_made_good_an_interval_after_it_has_left() {
        for outlier in [1e2, 1e3] {
            let mut hit = EstimatorGroup::new(SETTINGS, splat(1e-4));
            let mut spared = hit.clone();
            for k in 0..1500 {
                let mut disturbed = sample(k);
                disturbed[1] += if k == 400 { outlier } else { 0.0 };
                let found = hit.push(disturbed)[1].divergence();
                // Its last window ends at 409 and leaves the interval at 709.
                if k < 410 {
                    continue;
                }
                let expected = spared.push(sample(k))[1].divergence();
                if k > 709 + 310 {
                    let (found, expected) = (found.unwrap(), expected.unwrap());
                    let error = (found - expected).abs() / (1.0 + expected);
                    assert!(error < 1e-13, "{outlier} {k}: {error:e}");
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
