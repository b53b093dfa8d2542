//! What can be wrong with a gage. Small hypotheses stand here; an intermittent contact, and what no kind explains, have
//! files of their own.

mod intermittent;
mod process;
pub(super) mod record;

use vocabulary::{FaultSize, IdentifiedKind::Known, SignaturePoint, fault::FaultKind};

use self::record::{GagePoint, GageRecord, Onset, Wandering};
use super::Hypothesis;
use super::level::{LevelFilter, Prior, Weighed, deviance};
use super::mixture::Mixture;

/// All of them.
pub(super) const HYPOTHESES: [Hypothesis<GageRecord>; 8] = [
    BIAS,
    DRIFT,
    GAIN,
    intermittent::HYPOTHESIS,
    ZERO_OUTPUT,
    STUCK,
    RANDOM_WALK,
    process::HYPOTHESIS,
];

/// By how much a size may be wrong beyond what noise and wandering make of it, as a share of it: the controller moves the
/// structure by what a faulty gage reads, and how the others follow that is known from the model and the strokes, within a
/// tenth. From seeds of their own, see the study's `IDENTIFICATION.md`.
const OF_CONTROLLER: f64 = 0.0017;
/// How likely it is that the controller's answer shows in the gage that misleads it, and by what share of the displacement it
/// then moves the level in a second, each as likely as the others.
const ANSWERED: f64 = 0.1;
const ANSWERS: [f64; 3] = [0.01, 0.03, 0.1];
/// By how much what a gage should read may be wrong, as a share: for its gain.
const OF_EXPECTED: f64 = 0.01;
/// How large a displacement may be beforehand, any order of magnitude as likely as any other: normal priors about zero with
/// these deviations, times a unit, each as likely as the others.
const SCALES: [f64; 9] = [1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1e3, 3e3, 1e4];
/// By how much the gain may differ from one: normal, each as likely as the others.
const GAIN_DEVIATIONS: [f64; 4] = [0.03, 0.1, 0.3, 1.0];
/// What a repeated reading may differ by, in standard deviations of the gage's noise: what a converter makes of it.
const REPEATS_WITHIN: f64 = 0.01;
/// Standard deviation of a random walk's increment, in standard deviations of the gage's noise; each as likely as the
/// others.
const INCREMENTS: [f64; 10] = [0.03, 0.08, 0.2, 0.5, 1.25, 3.0, 8.0, 20.0, 50.0, 125.0];
/// About the likeliest increment, so many on either side are weighed as well, each so many times the one before.
const NEAR: i32 = 20;
const RATIO: f64 = 1.06;

/// It reads a constant amount too much: a step at the onset \[m\], from its own noise to ten thousand times that.
const BIAS: Hypothesis<GageRecord> = Hypothesis {
    kind: Known(FaultKind::Bias),
    prior: 1.0,
    weigh: |record| {
        let unit_m = record.own_noise_m2.sqrt();
        let error = |size: f64| OF_CONTROLLER * size;
        displacement(record, bias_m, error, |onset, wandering, answer_m2_per_s| {
            let share = |point: &GagePoint| point.share_after(onset.at_s);
            let filter = record.follow(onset, wandering, answer_m2_per_s, share);
            at_all_scales(&filter, unit_m)
        })
    },
    show: |record, best| departed(record, best, bias_m),
};

/// Its offset grows steadily: a ramp from the onset on \[m/s\], by its own noise in a hundred seconds, up to ten thousand
/// times its noise in a second.
const DRIFT: Hypothesis<GageRecord> = Hypothesis {
    kind: Known(FaultKind::Drift),
    prior: 1.0,
    weigh: |record| {
        let unit_m = record.own_noise_m2.sqrt();
        let cases = record.over_onsets(|onset, wandering| {
            let time_s = |point: &GagePoint| point.time_after_s(onset.at_s);
            let filter = record.follow(onset, wandering, 0.0, time_s);
            [0.01, 1.0].iter().flat_map(|unit| at_all_scales(&filter, unit * unit_m)).collect()
        });
        let age_s = cases.likeliest().map_or(0.0, |best| record.age_s(&best));
        let (cases, size) = cases.sized(|size| OF_CONTROLLER * size / age_s.max(1.0));
        (process::not_quite(record, cases, drift_m), size)
    },
    show: |record, best| departed(record, best, drift_m),
};

/// Its reading is multiplied by a factor: the error is proportional to the elongation that the other gages predict. A part
/// of the structure that has become softer has the same effect, with a gain above one.
const GAIN: Hypothesis<GageRecord> = Hypothesis {
    kind: Known(FaultKind::Gain),
    prior: 1.0,
    weigh: |record| {
        let error = |gain: f64| OF_EXPECTED * (gain - 1.0);
        displacement(record, gain_m, error, |onset, wandering, answer_m2_per_s| {
            // It read so much more than the others say before.
            let (before_m, _) = wandering.before(onset).level();
            let filter = record.follow(onset, wandering, answer_m2_per_s, |point| {
                (point.expected_m + before_m) * point.share_after(onset.at_s)
            });
            let priors = GAIN_DEVIATIONS.iter().map(|deviation| Prior::about_zero(*deviation));
            let weighed = priors.filter_map(|prior| filter.weigh(&[prior]));
            weighed.map(|case| Weighed { mean: 1.0 + case.mean, ..case }).collect()
        })
    },
    show: |record, best| departed(record, best, gain_m),
};

/// It reads zero, noise apart, whatever the others say.
const ZERO_OUTPUT: Hypothesis<GageRecord> = Hypothesis {
    kind: Known(FaultKind::ZeroOutput),
    prior: 1.0,
    weigh: |record| {
        let deviances = record.own_deviances(|point| point.reading_m);
        (without_size(record, |onset| deviances[onset.first]), None)
    },
    show: |record, best| record.signature(best, |point, _, _| point.off_m - point.reading_m),
};

/// It repeats its last reading.
const STUCK: Hypothesis<GageRecord> = Hypothesis {
    kind: Known(FaultKind::Stuck),
    prior: 1.0,
    weigh: |record| (without_size(record, |onset| held(record, onset)), None),
    show: |record, best| {
        record.signature(best, |point, onset, _| {
            point.off_m - point.reading_m + record.points[onset.first].reading_m
        })
    },
};

/// Its offset wanders: from the onset on each step adds a normal increment \[m per step\].
const RANDOM_WALK: Hypothesis<GageRecord> = Hypothesis {
    kind: Known(FaultKind::RandomWalk),
    prior: 1.0,
    weigh: |record| {
        let unit = record.own_noise_m2.sqrt();
        let wandering = record.likeliest_wandering();
        let cases = record.over_onsets_with(wandering, |onset, wandering| {
            let weigh = |increment: &f64| walk(record, onset, wandering, increment * unit);
            INCREMENTS.iter().map(weigh).collect()
        });
        let size = wandering.first().zip(cases.likeliest()).and_then(|(wandering, likeliest)| {
            let onset = &record.onsets[likeliest.place];
            increment(|increment| walk(record, onset, wandering, increment), likeliest.mean)
        });
        (cases, size)
    },
    // It goes anywhere.
    show: |record, best| record.signature(best, |point, _, _| point.off_m),
};

/// By how much a size displaces a point \[m\], given the onset and how much the gage read too much before it.
type Displaced = fn(&GagePoint, &Onset, f64, f64) -> f64;

fn bias_m(point: &GagePoint, onset: &Onset, _: f64, offset_m: f64) -> f64 {
    offset_m * point.share_after(onset.at_s)
}

fn drift_m(point: &GagePoint, onset: &Onset, _: f64, drift_m_per_s: f64) -> f64 {
    drift_m_per_s * point.time_after_s(onset.at_s)
}

fn gain_m(point: &GagePoint, onset: &Onset, level_m: f64, gain: f64) -> f64 {
    (gain - 1.0) * (point.expected_m + level_m) * point.share_after(onset.at_s)
}

/// The signature of a fault that displaces every reading after its onset.
fn departed(record: &GageRecord, best: &Weighed, displaced: Displaced) -> Vec<SignaturePoint> {
    record.signature(best, |point, onset, level_m| {
        level_m + displaced(point, onset, level_m, best.mean)
    })
}

/// By how much a case displaces the reading at most \[m\].
fn departure_m(record: &GageRecord, best: &Weighed, displaced: Displaced) -> f64 {
    let onset = &record.onsets[best.place];
    let before = record.likeliest_wandering().first().map(|wandering| wandering.before(onset));
    let level_m = before.map_or(0.0, |before| before.level().0);
    let after = record.points[onset.first..].iter();
    after.map(|point| displaced(point, onset, level_m, best.mean).abs()).fold(0.0, f64::max)
}

/// Weighs what displaces all points over all onsets and every likely way in which the level wanders: as it is, with a model
/// that is not quite right, and with an answer of the controller. Its size may be wrong by `error` more than noise makes it.
fn displacement(
    record: &GageRecord,
    displaced: Displaced,
    error: impl Fn(f64) -> f64,
    weigh: impl Fn(&Onset, &Wandering, f64) -> Vec<Weighed>,
) -> (Mixture, Option<FaultSize>) {
    let exact = record.over_onsets(|onset, wandering| weigh(onset, wandering, 0.0));
    let departure_m = exact.likeliest().map_or(0.0, |best| departure_m(record, &best, displaced));
    let answered = answered(record, departure_m, weigh);
    let mut both = exact.clone();
    both.extend(answered.clone(), 1.0);
    let (_, size) = both.sized(error);
    let mut cases = process::not_quite(record, exact, displaced);
    cases.extend(answered, 1.0);
    (cases, size)
}

/// The same cases with an answer of the controller to this displacement \[m\], which moves the level by so much more in a
/// second \[m²\].
fn answered(
    record: &GageRecord,
    departure_m: f64,
    weigh: impl Fn(&Onset, &Wandering, f64) -> Vec<Weighed>,
) -> Mixture {
    let mut cases = Mixture::default();
    for answer_m in ANSWERS.map(|answer| answer * departure_m) {
        // Less is among the ways in which a healthy level wanders.
        if answer_m * answer_m > record.own_noise_m2 {
            let answered = record
                .over_onsets_with(record.likeliest_wandering(), |onset, wandering| {
                    weigh(onset, wandering, answer_m * answer_m)
                });
            cases.extend(answered, ANSWERED / ANSWERS.len() as f64);
        }
    }
    cases
}

/// What a filter says of its coefficient at each scale.
fn at_all_scales(filter: &LevelFilter<1>, unit: f64) -> Vec<Weighed> {
    SCALES.iter().filter_map(|scale| filter.weigh(&[Prior::about_zero(scale * unit)])).collect()
}

/// Logarithm of the density of a displacement beforehand.
fn log_density(displacement: f64, unit: f64) -> f64 {
    let of_scale = |scale: &f64| {
        let variance = (scale * unit).powi(2);
        (-0.5 * deviance(displacement, variance)).exp()
    };
    (SCALES.iter().map(of_scale).sum::<f64>() / SCALES.len() as f64).ln()
}

/// A hypothesis that has no size, by the deviance of everything from an onset on.
fn without_size(record: &GageRecord, deviance: impl Fn(&Onset) -> f64) -> Mixture {
    record.over_onsets(|onset, wandering| {
        let log_likelihood = wandering.before(onset).log_likelihood() - 0.5 * deviance(onset);
        vec![Weighed::of(log_likelihood)]
    })
}

/// Deviance of readings that repeat the last good one: the first of them, or the one before.
fn held(record: &GageRecord, onset: &Onset) -> f64 {
    let variance = REPEATS_WITHIN * REPEATS_WITHIN * record.own_noise_m2;
    let first = record.points[onset.first].reading_m;
    let before = record.points[onset.first.saturating_sub(1)].reading_m;
    let repeats = (first - before).abs() <= variance.sqrt();
    let held = if repeats { before } else { first };
    let points = &record.points[onset.first..];
    points.iter().map(|point| deviance(point.reading_m - held, variance)).sum()
}

/// The increment about the likeliest one of few, each order of magnitude being as likely as the other.
fn increment(weigh: impl Fn(f64) -> Weighed, about_m: f64) -> Option<FaultSize> {
    let mut near = Mixture::default();
    for k in -NEAR..=NEAR {
        let case = weigh(about_m * RATIO.powi(k));
        near.add(Weighed { variance: (0.5 * (RATIO - 1.0) * case.mean).powi(2), ..case });
    }
    near.size()
}

fn walk(record: &GageRecord, onset: &Onset, wandering: &Wandering, increment_m: f64) -> Weighed {
    let per_s = increment_m * increment_m / record.step_s;
    let log_likelihood = record.wandered(onset, wandering, per_s, |point| point.off_m);
    Weighed { mean: increment_m, ..Weighed::of(log_likelihood) }
}
