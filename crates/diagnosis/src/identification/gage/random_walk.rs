//! The gage's offset wanders: from the onset on each step adds a normal increment \[m per step\].

use vocabulary::fault::FaultKind;

use super::record::{Onset, Record};
use crate::identification::hypothesis::{Hypothesis, Weighing};
use crate::identification::level::{Level, Weighed};
use crate::identification::mixture::{Mixture, Size};

/// Standard deviation of the increment, in standard deviations of the gage's noise; each as likely as the others.
const INCREMENTS: [f64; 10] = [0.03, 0.08, 0.2, 0.5, 1.25, 3.0, 8.0, 20.0, 50.0, 125.0];
/// About the likeliest one, so many on either side are weighed as well, each so many times the one before.
const NEAR: i32 = 20;
const RATIO: f64 = 1.06;

pub(super) const HYPOTHESIS: Hypothesis<Record> = Hypothesis {
    kind: FaultKind::RandomWalk,
    prior: 1.0,
    weigh: |record| {
        let unit = record.own_noise_m2.sqrt();
        let wandering = record.likeliest_wandering();
        let cases = record.over_onsets_with(wandering, |onset, wandering| {
            let before = wandering.before(onset);
            let weigh = |increment: &f64| walk(record, onset, before, increment * unit);
            INCREMENTS.iter().map(weigh).collect()
        });
        let size = wandering.first().zip(cases.likeliest()).and_then(|(wandering, likeliest)| {
            let onset = &record.onsets[likeliest.place];
            let before = wandering.before(onset);
            size(|increment| walk(record, onset, before, increment), likeliest.mean)
        });
        Weighing { size, ..Weighing::without_size(&cases) }
    },
    // It goes anywhere.
    show: |record, best| record.signature(best, |point, _, _| point.off_m),
};

/// The increment about the likeliest one of few, each order of magnitude being as likely as the other.
fn size(weigh: impl Fn(f64) -> Weighed, about_m: f64) -> Option<Size> {
    let mut near = Mixture::default();
    for k in -NEAR..=NEAR {
        let case = weigh(about_m * RATIO.powi(k));
        near.add(Weighed { variance: (0.5 * (RATIO - 1.0) * case.mean).powi(2), ..case });
    }
    near.size()
}

fn walk(record: &Record, onset: &Onset, before: &Level<0>, increment_m: f64) -> Weighed {
    let mut level = before.clone();
    let per_s = increment_m * increment_m / record.step_s;
    for (place, point) in record.points.iter().enumerate().skip(onset.first) {
        level.take(point.off_m, record.walked(place, per_s), record.noise_m2 / point.count, []);
    }
    Weighed { log_likelihood: level.log_likelihood(), mean: increment_m, variance: 0.0, place: 0 }
}
