//! None of the known kinds: from the onset on, a process of any size and pace is added to the reading. And what a kind's
//! model may be wrong by, which is a small one of these.
//!
//! The process is Matérn's of smoothness 3/2, of covariance σ² (1 + λτ) exp(−λτ), λ = √3/time (Rasmussen and Williams,
//! *Gaussian processes for machine learning*, 2006, 4.2.1). With its derivative over λ it is a Markov process, whose
//! transition over Δ with x = λΔ is e^{−x} ((1 + x, x), (−x, 1 − x)) (Hartikainen and Särkkä, *Kalman filtering and
//! smoothing solutions to temporal Gaussian process regression models*, MLSP 2010). It is the same backwards: one Kalman
//! filter from the last point back has the likelihood of all points from any onset on.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};
use vocabulary::IdentifiedKind;

use super::record::{GagePoint, GageRecord, Wandering};
use super::{Displaced, departure_m};
use crate::identification::level::{Weighed, deviance};
use crate::identification::mixture::Mixture;
use crate::identification::{Hypothesis, NONE_PRIOR};

/// Standard deviations of the process, in those of the gage's noise, and its times \[s\]; each as likely as the others.
const DEVIATIONS: [f64; 7] = [10.0, 30.0, 100.0, 300.0, 1e3, 3e3, 1e4];
const TIMES_S: [f64; 7] = [0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0];
/// What a kind's model leaves of a departure, as a share of its largest value, asks for no other reason: the others
/// follow the faulty gage through the controller, on a structure and by strokes that are known within a tenth. Each is as
/// likely as the other.
const MODEL_ERRORS: [f64; 2] = [0.03, 0.1];
/// How likely it is that the model leaves anything.
const IS_WRONG: f64 = 0.5;
/// Where nothing is known of the level from later points: its variance as a multiple of everything that may move it.
const UNKNOWN: f64 = 1e4;

pub(super) const HYPOTHESIS: Hypothesis<GageRecord> = Hypothesis {
    kind: IdentifiedKind::NoneOfThese,
    prior: NONE_PRIOR,
    weigh: |record| {
        let likeliest = record.likeliest_wandering();
        let unit_m = record.own_noise_m2.sqrt();
        let sizes =
            DEVIATIONS.iter().flat_map(|size| TIMES_S.map(|time_s| (size * unit_m, time_s)));
        let process = |size| {
            likeliest
                .first()
                .map(|wandering| from_each_place(record, wandering, 0, size, |point| point.off_m))
        };
        let processes: Vec<Vec<f64>> = sizes.filter_map(process).collect();
        let cases = record.over_onsets_with(likeliest, |onset, wandering| {
            let before = wandering.before(onset).log_likelihood();
            processes.iter().map(|after| Weighed::of(before + after[onset.first])).collect()
        });
        (cases, None)
    },
    // It goes anywhere.
    show: |record, best| record.signature(best, |point, _, _| point.off_m),
};

/// The same cases, and the likeliest one with a model that is not quite right.
pub(super) fn not_quite(record: &GageRecord, cases: Mixture, displaced: Displaced) -> Mixture {
    let best = cases.likeliest();
    let mut all = Mixture::default();
    all.extend(cases, 1.0 - IS_WRONG);
    let Some(best) = best else { return all };
    let onset = &record.onsets[best.place];
    let level_m = |wandering: &Wandering| wandering.before(onset).level().0;
    // The case itself, with the size that it has in the middle.
    let exact = |wandering: &Wandering| {
        let level_m = level_m(wandering);
        let left_m = |point: &GagePoint| point.off_m - displaced(point, onset, level_m, best.mean);
        record.wandered(onset, wandering, wandering.m2_per_s, left_m)
    };
    let each = record.wanderings.iter().map(|wandering| (wandering, exact(wandering)));
    let Some((wandering, exact)) = each.max_by(|(_, a), (_, b)| a.total_cmp(b)) else { return all };
    // Over all its sizes it is not likelier than with the best one: where no size comes near, the middle is not that.
    let exact = exact.max(best.log_likelihood);
    let (before, level_m) = (wandering.before(onset), level_m(wandering));
    let displaced_m = |point: &GagePoint| displaced(point, onset, level_m, best.mean);
    let left_m = |point: &GagePoint| point.off_m - displaced_m(point);
    let departure_m = departure_m(record, &best, displaced);
    // The size is as uncertain as the model, which the case does not know yet: Laplace's approximation of its integral.
    let last = &record.points[record.points.len() - 1];
    let unit_m = displaced(last, onset, level_m, best.mean + 1.0) - displaced_m(last);
    let age_s = record.age_s(&best);
    let share = IS_WRONG / (MODEL_ERRORS.len() * TIMES_S.len()) as f64;
    for (wrong, time_s) in
        MODEL_ERRORS.iter().flat_map(|wrong| TIMES_S.map(|time_s| (wrong, time_s)))
    {
        let uncertain = (wrong * displaced_m(last) / unit_m).powi(2) / best.variance;
        let size = (wrong * departure_m, time_s);
        let after = from_each_place(record, wandering, onset.first, size, left_m)[onset.first];
        let gained = before.log_likelihood() + after - exact;
        let wider = 0.5 * (uncertain * (2.0 * time_s / age_s).min(1.0)).ln_1p();
        let log_likelihood = best.log_likelihood + gained + wider + share.ln();
        all.add(Weighed { log_likelihood, ..best });
    }
    all
}

/// Logarithms of the likelihood of the points from each place on, down to `first`, given those before it, if what they are
/// left with is the level, noise and from there on a process of this deviation \[m\] and time \[s\].
fn from_each_place(
    record: &GageRecord,
    wandering: &Wandering,
    first: usize,
    (deviation_m, time_s): (f64, f64),
    left_m: impl Fn(&GagePoint) -> f64,
) -> Vec<f64> {
    (record.pause)();
    let points = &record.points;
    let mut logs = vec![f64::NEG_INFINITY; points.len()];
    let since_s = |place: usize| match place.checked_sub(1) {
        Some(before) => (points[place].middle_s() - points[before].middle_s()).abs(),
        None => 0.0,
    };
    let process_m2 = deviation_m * deviation_m;
    let (level_m, level_m2) = wandering.before[first].level();
    let all_s: f64 = (first..points.len()).map(since_s).sum();
    let unknown_m2 = UNKNOWN * (process_m2 + level_m2 + wandering.m2_per_s * all_s);
    // Level, process, and the process's derivative over λ.
    let mut state = Vector3::new(level_m, 0.0, 0.0);
    let mut covariance = Matrix3::from_diagonal(&Vector3::new(unknown_m2, process_m2, process_m2));
    // In the limit of a level of which nothing is known.
    let mut log = 0.5 * (TAU * unknown_m2).ln();
    for place in (first..points.len()).rev() {
        let spread = covariance.column(0) + covariance.column(1);
        let variance = spread[0] + spread[1] + record.noise_m2 / points[place].count;
        let innovation = left_m(&points[place]) - state[0] - state[1];
        log -= 0.5 * deviance(innovation, variance);
        state += spread * (innovation / variance);
        covariance -= spread * spread.transpose() / variance;
        let walked_m2 = wandering.m2_per_s * since_s(place);
        let (known_m, known_m2) = wandering.before[place].level();
        let both_m2 = covariance[(0, 0)] + known_m2 + walked_m2;
        logs[place] = log - 0.5 * deviance(state[0] - known_m, both_m2);
        let x = 3_f64.sqrt() / time_s * since_s(place);
        let [stays, turns, slows] = [1.0 + x, x, 1.0 - x].map(|factor| factor * (-x).exp());
        let over = Matrix3::new(1.0, 0.0, 0.0, 0.0, stays, turns, 0.0, -turns, slows);
        let kept = over.fixed_view::<2, 2>(1, 1) * over.fixed_view::<2, 2>(1, 1).transpose();
        state = over * state;
        covariance = over * covariance * over.transpose();
        covariance[(0, 0)] += walked_m2;
        let mut process = covariance.fixed_view_mut::<2, 2>(1, 1);
        process += (nalgebra::Matrix2::identity() - kept) * process_m2;
    }
    logs
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use nalgebra::{DMatrix, DVector};
    use vocabulary::{RunId, Step};

    use super::*;
    use crate::identification::level::Prior;
    use crate::identification::{self, Excerpt, FaultOnset, GageSeries, GageStep, MeasuredSeries};

    /// A gage of noise one with a slow wave from step 40 on, noticed at step 50, as of step 90.
    fn excerpt(step_s: f64) -> Excerpt {
        let step = |step: u64| {
            let noise = (2.4 * (step * step) as f64).sin();
            let wave = if step < 40 { 0.0 } else { 30.0 * (0.1 * (step as f64 - 30.0)).sin() };
            GageStep { step: Step(step), off_m: noise + wave, reading_m: noise + wave }
        };
        let series = GageSeries {
            steps: (0..90).map(step).collect(),
            seconds: Vec::new(),
            level_m: Prior::about_zero(2.0),
            noise_m: 1.0,
        };
        Excerpt {
            run: RunId(1),
            sequence: 1,
            component: "sensor/g1".parse().unwrap(),
            as_of: Step(90),
            step_s,
            seen: FaultOnset::Change { onset: Step(40), detection: Step(50) },
            measured: MeasuredSeries::Gage(series),
        }
    }

    #[test]
    fn the_likelihood_from_each_place_on_is_that_of_the_joint_normal() {
        let excerpt = excerpt(1e-3);
        let MeasuredSeries::Gage(series) = &excerpt.measured else { panic!("a gage") };
        let record = GageRecord::new(&excerpt, series, || ()).unwrap();
        let wandering = &record.wanderings[0];
        let size = (20.0, 0.03);
        let logs = from_each_place(&record, wandering, 0, size, |point| point.off_m);
        for first in [record.points.len() - 1, record.points.len() / 2, 3] {
            let points = &record.points[first..];
            let begun_s = record.points[first - 1].middle_s();
            let (level_m, level_m2) = wandering.before[first].level();
            let covariance = DMatrix::from_fn(points.len(), points.len(), |a, b| {
                let [a_s, b_s] = [a, b].map(|k| points[k].middle_s());
                let x = 3_f64.sqrt() / size.1 * (a_s - b_s).abs();
                let noise = if a == b { record.noise_m2 / points[a].count } else { 0.0 };
                let walked = wandering.m2_per_s * (a_s.min(b_s) - begun_s);
                level_m2 + walked + noise + size.0 * size.0 * (1.0 + x) * (-x).exp()
            });
            let off = DVector::from_fn(points.len(), |k, _| points[k].off_m - level_m);
            let factor = covariance.cholesky().unwrap();
            let logs_of_root: f64 = factor.l().diagonal().iter().map(|d| d.ln()).sum();
            let count = points.len() as f64;
            let expected = -0.5 * (off.dot(&factor.solve(&off)) + count * TAU.ln()) - logs_of_root;
            assert!((logs[first] - expected).abs() < 1e-2, "{first}: {} {expected}", logs[first]);
        }
    }

    #[test]
    fn a_wave_is_of_none_of_the_kinds() {
        let found = identification::identify(&excerpt(0.02), None);
        let decided = found.decided().unwrap_or_else(|| panic!("{found:?}"));
        assert_eq!((decided.kind, decided.size), (IdentifiedKind::NoneOfThese, None));
    }

    #[test]
    fn in_pieces_the_result_is_the_same_and_others_are_let_go_first_many_times() {
        thread_local!(static PAUSES: Cell<u32> = const { Cell::new(0) });
        let pause: fn() = || PAUSES.set(PAUSES.get() + 1);
        let excerpt = excerpt(1e-3);
        let in_pieces = identification::identify_in_pieces(&excerpt, None, pause);
        assert_eq!(in_pieces, identification::identify(&excerpt, None));
        assert!(PAUSES.get() > 100, "{} pauses", PAUSES.get());
    }

    #[test]
    fn in_the_first_half_second_nothing_is_decided_to_be_none_of_the_kinds() {
        let found = identification::identify(&excerpt(1e-3), None);
        let none = found.candidates.iter().find(|of| of.kind == IdentifiedKind::NoneOfThese);
        assert!((none.unwrap().probability - 0.5).abs() < 1e-9, "{found:?}");
        assert!(found.decided().is_none(), "{found:?}");
    }
}
