//! The gage has a bad contact: while that is open, it reads a constant amount too much \[m\]; the contact opens and closes
//! by chance.
//!
//! A hidden Markov model of two states (Rabiner, *A tutorial on hidden Markov models*, Proc. IEEE 77, 1989): the forward
//! recursion gives the likelihood, and a few rounds of expectation and maximisation the offset.

use std::f64::consts::TAU;

use names::fault::FaultKind;

use super::record::{Onset, Point, Record};
use super::scales::log_density;
use crate::identification::hypothesis::{Hypothesis, Weighing};
use crate::identification::level::{Level, Weighed, deviance};

/// Mean times for which the contact is closed, and open \[s\].
const CLOSED_S: f64 = 0.3;
const OPEN_S: f64 = 0.3;
/// Rounds for the offset.
const ROUNDS: usize = 3;

pub(super) const HYPOTHESIS: Hypothesis<Record> = Hypothesis {
    kind: FaultKind::Intermittent,
    prior: 1.0,
    weigh: |record| {
        let cases = record.over_onsets(|onset, wandering| {
            weigh(record, onset, wandering.before(onset)).into_iter().collect()
        });
        Weighing::sized(&cases)
    },
};

/// Weighs a contact that is open at the onset.
fn weigh(record: &Record, onset: &Onset, before: &Level<0>) -> Option<Weighed> {
    let points = &record.points[onset.first..];
    let (level, uncertain) = before.level();
    let mut offset = points.first()?.off_m - level;
    let mut passed = Passed::default();
    for _ in 0..ROUNDS {
        passed = Contact { record, level, uncertain, offset }.pass(points);
        if passed.open > 0.5 {
            offset = passed.sum / passed.open;
        }
    }
    let variance = uncertain + record.noise_m2 / passed.open.max(1.0);
    // Laplace's approximation of the integral over the offset.
    let integral = log_density(offset, record.own_noise_m2.sqrt()) + 0.5 * (TAU * variance).ln();
    Some(Weighed {
        log_likelihood: before.log_likelihood() + passed.log_likelihood + integral,
        mean: offset,
        variance,
    })
}

/// A contact, and what the gage reads too much while it is open.
struct Contact<'a> {
    record: &'a Record,
    level: f64,
    uncertain: f64,
    offset: f64,
}

/// What a pass over points says.
#[derive(Default)]
struct Passed {
    log_likelihood: f64,
    /// Steps in which it is open, and the sum of what it reads too much in them \[m\].
    open: f64,
    sum: f64,
}

impl Contact<'_> {
    fn pass(&self, points: &[Point]) -> Passed {
        let mut passed = Passed::default();
        // How likely it is closed and open.
        let mut state = [0.0, 1.0];
        for (place, point) in points.iter().enumerate() {
            let stays = match place {
                0 => [1.0; 2],
                _ => {
                    [CLOSED_S, OPEN_S].map(|mean| (-point.count * self.record.step_s / mean).exp())
                }
            };
            let [still, switched] = self.densities(point);
            let [closed, open] = [0, 1].map(|k| {
                state[k] * stays[k] * still[k] + state[1 - k] * (1.0 - stays[1 - k]) * switched[k]
            });
            let all = closed + open;
            if all <= 0.0 {
                passed.log_likelihood = f64::NEG_INFINITY;
                return passed;
            }
            passed.log_likelihood += all.ln();
            state = [closed / all, open / all];
            // A point in which it switches says little of the offset.
            let stayed_open = state[1] * still[1] / (still[1] + switched[1]).max(f64::MIN_POSITIVE);
            let weight = if point.count > 1.0 { stayed_open } else { state[1] } * point.count;
            passed.open += weight;
            passed.sum += weight * (point.off_m - self.level);
        }
        passed
    }

    /// Densities of what it reads at the end of which it is closed, and open: if it was so throughout, and if it switched.
    fn densities(&self, point: &Point) -> [[f64; 2]; 2] {
        let variance = self.uncertain + self.record.noise_m2 / point.count;
        let off = point.off_m - self.level;
        let normal = |mean: f64| (-0.5 * deviance(off - mean, variance)).exp();
        let still = [normal(0.0), normal(self.offset)];
        if point.count <= 1.0 {
            return [still, still];
        }
        // Its mean is anywhere between the two.
        let width = self.offset.abs().max(variance.sqrt());
        let share = off / self.offset;
        let between = if (0.0..=1.0).contains(&share) { 1.0 / width } else { 0.0 };
        [still, [between.max(1e-3 * still[0]), between.max(1e-3 * still[1])]]
    }
}
