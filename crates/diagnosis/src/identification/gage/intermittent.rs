//! The gage has a bad contact: while that is open, it reads a constant amount too much \[m\]; the contact opens and closes
//! by chance.
//!
//! A hidden Markov model of two states (Rabiner, *A tutorial on hidden Markov models*, Proc. IEEE 77, 1989): the forward
//! recursion gives the likelihood, and a few rounds of expectation and maximisation the offset.

use std::cell::Cell;
use std::f64::consts::TAU;

use vocabulary::{IdentifiedKind, fault::FaultKind};

use super::record::{GagePoint, GageRecord, Onset, Wandering};
use super::{answered, log_density};
use crate::identification::Hypothesis;
use crate::identification::level::{LevelFilter, Weighed, deviance};

/// Mean times for which the contact is closed, and open \[s\].
const CLOSED_S: f64 = 0.3;
const OPEN_S: f64 = 0.25;
/// How much less likely, as a logarithm, a mean that is not between the two is when it switches.
const RARELY: f64 = 7.0;
/// By how much the offset may be wrong, as a share: points that it is partly open in are taken for open.
const OF_POINTS: f64 = 0.02;
/// Rounds for the offset.
const ROUNDS: usize = 3;
/// Another round does not make up for so much less of a log-likelihood than the largest one's.
const HOPELESS: f64 = 300.0;

pub(super) const HYPOTHESIS: Hypothesis<GageRecord> = Hypothesis {
    kind: IdentifiedKind::Known(FaultKind::Intermittent),
    prior: 0.5,
    weigh: |record| {
        let likeliest = Cell::new(f64::NEG_INFINITY);
        let weigh = |onset: &Onset, wandering: &Wandering, answer_m2_per_s: f64| {
            let m2_per_s = wandering.m2_per_s + answer_m2_per_s;
            let least = likeliest.get() - HOPELESS;
            let case = weigh(record, onset, wandering.before(onset), m2_per_s, least);
            let log = case.map_or(f64::NEG_INFINITY, |case| case.log_likelihood);
            likeliest.set(likeliest.get().max(log));
            case.into_iter().collect()
        };
        let mut cases = record.over_onsets(|onset, wandering| weigh(onset, wandering, 0.0));
        let offset_m = cases.likeliest().map_or(0.0, |best| best.mean);
        cases.extend(answered(record, offset_m, weigh), 1.0);
        cases.sized(|offset| OF_POINTS * offset)
    },
    show: |record, best| {
        record.signature(best, |point, _, level_m| {
            let share = ((point.off_m - level_m) / best.mean).clamp(0.0, 1.0);
            // A single step is either open or closed.
            level_m + best.mean * if point.count > 1.0 { share } else { share.round() }
        })
    },
};

/// Weighs a contact that fails at the onset, given the filter before it and by how much the level moves in a second after it
/// \[m²\]; only once if that is less likely than this.
fn weigh(
    record: &GageRecord,
    onset: &Onset,
    before: &LevelFilter<0>,
    m2_per_s: f64,
    least: f64,
) -> Option<Weighed> {
    let points = &record.points[onset.first..];
    let (level, uncertain) = before.level();
    // In a single step it is open or closed; the farthest off is open.
    let single =
        points.iter().take_while(|point| point.count <= 1.0).map(|point| point.off_m - level);
    let farthest = single.max_by(|a, b| a.abs().total_cmp(&b.abs()));
    let mut offset = farthest.unwrap_or(points.first()?.off_m - level);
    let mut passed = ContactPass::default();
    for _ in 0..ROUNDS {
        passed = ContactModel { record, onset, m2_per_s, level, uncertain, offset }.pass(points);
        if passed.open > 0.5 {
            offset = passed.sum / passed.open;
        }
        if before.log_likelihood() + passed.log_likelihood < least {
            break;
        }
    }
    let variance = uncertain + record.noise_m2 / passed.open.max(1.0);
    // Laplace's approximation of the integral over the offset.
    let integral = log_density(offset, record.own_noise_m2.sqrt()) + 0.5 * (TAU * variance).ln();
    let log_likelihood = before.log_likelihood() + passed.log_likelihood + integral;
    Some(Weighed { mean: offset, variance, ..Weighed::of(log_likelihood) })
}

/// A contact, and what the gage reads too much while it is open.
struct ContactModel<'a> {
    record: &'a GageRecord,
    onset: &'a Onset,
    /// By how much the level moves in a second \[m²\].
    m2_per_s: f64,
    level: f64,
    uncertain: f64,
    offset: f64,
}

/// What a pass over points says.
#[derive(Default)]
struct ContactPass {
    log_likelihood: f64,
    /// Number of steps with the contact open, and the sum of their excess readings \[m\].
    open: f64,
    sum: f64,
}

impl ContactModel<'_> {
    fn pass(&self, points: &[GagePoint]) -> ContactPass {
        let mut passed = ContactPass::default();
        // How likely it is closed and open.
        let mut state = [0.5; 2];
        let (mut count, mut stays) = (0.0, [1.0; 2]);
        for point in points {
            if point.count != count {
                count = point.count;
                stays = [CLOSED_S, OPEN_S].map(|mean| (-count * self.record.step_s / mean).exp());
            }
            let (scale, [still, switched]) = self.densities(point);
            let stayed = [0, 1].map(|k| state[k] * stays[k] * still[k]);
            let [closed, open] =
                [0, 1].map(|k| stayed[k] + state[1 - k] * (1.0 - stays[1 - k]) * switched[k]);
            let all = closed + open;
            if all <= 0.0 {
                passed.log_likelihood = f64::NEG_INFINITY;
                return passed;
            }
            passed.log_likelihood += all.ln() + scale;
            state = [closed / all, open / all];
            // A point in which it switches says little of the offset; a single step is one or the other.
            let is_open = if point.count > 1.0 { stayed[1] } else { open } / all;
            passed.open += is_open * point.count;
            passed.sum += is_open * point.count * (point.off_m - self.level);
        }
        passed
    }

    /// Densities of the reading given that the contact is closed, and open, at the end of the point: if it was so
    /// throughout, and if it switched; and the logarithm of their common factor.
    fn densities(&self, point: &GagePoint) -> (f64, [[f64; 2]; 2]) {
        let wandered = self.m2_per_s * (point.until_s - self.onset.at_s).max(0.0);
        let variance = self.uncertain + wandered + self.record.noise_m2 / point.count;
        let off = point.off_m - self.level;
        let logs = [0.0, self.offset].map(|mean| -0.5 * deviance(off - mean, variance));
        let nearest = logs[0].max(logs[1]);
        if point.count <= 1.0 {
            let still = logs.map(|log| (log - nearest).exp());
            return (nearest, [still, still]);
        }
        // The mean of a point in which it switches is anywhere between the two, but at least one step is as the others are not.
        let least = 0.5 / point.count;
        let is_between = (least..=1.0 - least).contains(&(off / self.offset));
        let width = self.offset.abs().max(variance.sqrt());
        let between = if is_between { -width.ln() } else { nearest - RARELY };
        let scale = nearest.max(between);
        let still = logs.map(|log| (log - scale).exp());
        (scale, [still, [(between - scale).exp(); 2]])
    }
}
