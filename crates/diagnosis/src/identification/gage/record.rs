//! A gage's series as a hypothesis sees it: points of single steps, of hundredths and of whole seconds.

use std::ops::Range;

use vocabulary::SignaturePoint;

use crate::identification::axis::SearchAxis;
use crate::identification::excerpt::{Excerpt, FaultOnset, GageSeries, GageStep};
use crate::identification::level::{
    LEAST_BEFORE, LevelFilter, Prior, Walked, Weighed, deviance, likely_walks,
};
use crate::identification::mixture::Mixture;
use crate::identification::points::{BLOCK_S, FINE_BEFORE_S, Grouping};
use crate::identification::signature::signature;

/// What a gage should read is taken from the steps within this time of a point, the point itself excepted \[s\].
const NEAR_S: f64 = 0.01;
/// Onsets apart, at first, as a share of their age.
const APART: f64 = 0.15;
/// No variance of noise is taken for less than this share of the configured one.
const LEAST_NOISE: f64 = 0.01;
/// Onsets within a point that is longer than a block, or in a gap before it.
const WITHIN: usize = 8;

/// Means over a stretch of time.
#[derive(Debug, Clone, Copy)]
pub(super) struct GagePoint {
    /// From and until when \[s\], from the detection on.
    from_s: f64,
    pub(super) until_s: f64,
    /// Steps that it is a mean of.
    pub(super) count: f64,
    /// How much more it reads than the others say \[m\].
    pub(super) off_m: f64,
    /// What it reads \[m\].
    pub(super) reading_m: f64,
    /// What it should read \[m\], without noise that is in `off_m` too.
    pub(super) expected_m: f64,
}

impl GagePoint {
    /// Which share of it is after a time.
    pub(super) fn share_after(&self, at_s: f64) -> f64 {
        let length = self.until_s - self.from_s;
        if at_s <= self.from_s || length <= 0.0 {
            return 1.0;
        }
        ((self.until_s - at_s) / length).clamp(0.0, 1.0)
    }

    /// Its middle \[s\].
    pub(super) fn middle_s(&self) -> f64 {
        0.5 * (self.from_s + self.until_s)
    }

    /// How long it is after a time, on average over it \[s\].
    pub(super) fn time_after_s(&self, at_s: f64) -> f64 {
        let middle = 0.5 * (self.until_s + self.from_s.max(at_s)) - at_s;
        self.share_after(at_s) * middle.max(0.0)
    }
}

/// An onset that is tried: when, and the first point that it affects.
#[derive(Debug, Clone, Copy)]
pub(super) struct Onset {
    pub(super) first: usize,
    pub(super) at_s: f64,
}

/// A way in which the level of a healthy gage may wander.
#[derive(Debug, Clone)]
pub(super) struct Wandering {
    /// How likely, in comparison with the others.
    share: f64,
    /// By how much in a second \[m²\].
    pub(super) m2_per_s: f64,
    /// The filter before each point, and after the last.
    pub(super) before: Vec<LevelFilter<0>>,
}

impl Wandering {
    /// The filter before an onset.
    pub(super) fn before(&self, onset: &Onset) -> &LevelFilter<0> {
        &self.before[onset.first]
    }
}

/// A series, ready to be weighed.
#[derive(Debug, Clone)]
pub(in crate::identification) struct GageRecord {
    pub(super) points: Vec<GagePoint>,
    /// Variance of one step's own noise \[m²\].
    pub(super) own_noise_m2: f64,
    /// Variance of one step's `off_m` \[m²\].
    pub(super) noise_m2: f64,
    /// Length of a step \[s\].
    pub(super) step_s: f64,
    grouping: Grouping,
    pub(super) wanderings: Vec<Wandering>,
    /// The first point that a fault may affect; 0 if nothing is known of that.
    earliest: usize,
    pub(super) onsets: Vec<Onset>,
    axis: SearchAxis,
    /// Called before each case that is weighed.
    pub(super) pause: fn(),
}

impl GageRecord {
    /// `None` without a single usable value.
    pub(in crate::identification) fn new(
        excerpt: &Excerpt,
        series: &GageSeries,
        pause: fn(),
    ) -> Option<Self> {
        let grouping = Grouping::of(excerpt);
        let steps = &series.steps;
        let points = points(&grouping, steps, &series.seconds);
        let before: Vec<GageStep> =
            steps.iter().filter(|step| is_before(excerpt, step)).copied().collect();
        let learnt = (before.len() >= LEAST_BEFORE).then_some(&before[..]);
        let own_m2 = series.noise_m * series.noise_m;
        // A quiet, coarse or stuck gage has less noise than configured, down to none at all.
        let least_m2 = LEAST_NOISE * own_m2;
        let white = |steps, value: fn(&GageStep) -> f64| {
            white(steps, value).map(|noise_m2| noise_m2.max(least_m2))
        };
        let noise_m2 = white(learnt.unwrap_or(steps), |step| step.off_m).unwrap_or(own_m2);
        let own_noise_m2 = learnt.and_then(|steps| white(steps, |step| step.reading_m));
        let onsets = onsets(&points);
        let earliest = points.iter().position(|point| point.until_s >= grouping.fine_from_s);
        let mut record = Self {
            axis: SearchAxis::of_onsets(onsets.iter().map(|onset| onset.at_s), APART),
            points,
            own_noise_m2: own_noise_m2.unwrap_or(own_m2).min(noise_m2),
            noise_m2,
            step_s: excerpt.step_s,
            grouping,
            wanderings: Vec::new(),
            earliest: earliest.unwrap_or(0),
            onsets,
            pause,
        };
        record.wanderings = record.likely_wanderings(series.level_m);
        (!record.onsets.is_empty()).then_some(record)
    }

    /// Weighs a hypothesis over all onsets, and over every likely way in which the level wanders.
    pub(super) fn over_onsets(
        &self,
        weigh: impl Fn(&Onset, &Wandering) -> Vec<Weighed>,
    ) -> Mixture {
        self.over_onsets_with(&self.wanderings, weigh)
    }

    /// The same over these ways only.
    pub(super) fn over_onsets_with(
        &self,
        wanderings: &[Wandering],
        weigh: impl Fn(&Onset, &Wandering) -> Vec<Weighed>,
    ) -> Mixture {
        let mut all = Mixture::default();
        let shares: f64 = wanderings.iter().map(|wandering| wandering.share).sum();
        for wandering in wanderings {
            let cases = self.axis.integrate(|place| {
                (self.pause)();
                weigh(&self.onsets[place], wandering)
            });
            all.extend(cases, wandering.share / shares);
        }
        all
    }

    /// How long ago a case's onset is \[s\].
    pub(super) fn age_s(&self, best: &Weighed) -> f64 {
        let onset = self.onsets.get(best.place);
        onset.zip(self.points.last()).map_or(0.0, |(onset, last)| last.until_s - onset.at_s)
    }

    /// What was measured, and what a case makes of it: from its onset on what `after` tells, given the onset and how much the
    /// gage read too much before it.
    pub(super) fn signature(
        &self,
        best: &Weighed,
        after: impl Fn(&GagePoint, &Onset, f64) -> f64,
    ) -> Vec<SignaturePoint> {
        let Some(onset) = self.onsets.get(best.place) else { return Vec::new() };
        let before = self.wanderings.first().map(|wandering| wandering.before(onset));
        let level_m = before.map_or(0.0, |before| before.level().0);
        let at = |(place, point): (usize, &GagePoint)| {
            let fitted = if place < onset.first { level_m } else { after(point, onset, level_m) };
            (point.until_s, point.off_m, fitted)
        };
        let series: Vec<_> = self.points.iter().enumerate().map(at).collect();
        signature(&series, onset.at_s, |at_s| self.grouping.step_at(at_s))
    }

    /// The likeliest way in which the level wanders before the onset, for what wanders in a way of its own after it.
    pub(super) fn likeliest_wandering(&self) -> &[Wandering] {
        let before = |wandering: &Wandering| wandering.before[self.earliest].log_likelihood();
        let each = self.wanderings.iter().enumerate();
        let likeliest = each.max_by(|(_, a), (_, b)| before(a).total_cmp(&before(b)));
        likeliest.map_or(&[], |(place, _)| &self.wanderings[place..=place])
    }

    /// How a level that moves by so much in a second has moved until the end of a point.
    pub(super) fn walked(&self, place: usize, m2_per_s: f64) -> Walked {
        let before = place.checked_sub(1).map(|before| self.points[before].until_s);
        let since_s = before.map_or(0.0, |before| self.points[place].until_s - before);
        Walked::during(m2_per_s * since_s, since_s / self.step_s)
    }

    /// Goes through the points from an onset on, with a regressor for each. From the onset on the level moves by so much
    /// more in a second than before.
    pub(super) fn follow(
        &self,
        onset: &Onset,
        wandering: &Wandering,
        more_m2_per_s: f64,
        regressor: impl Fn(&GagePoint) -> f64,
    ) -> LevelFilter<1> {
        let mut level: LevelFilter<1> = wandering.before(onset).widened();
        for (place, point) in self.points.iter().enumerate().skip(onset.first) {
            let walked = self.walked(place, wandering.m2_per_s + more_m2_per_s);
            level.take(point.off_m, walked, self.noise_m2 / point.count, [regressor(point)]);
        }
        level
    }

    /// Logarithm of the likelihood if from an onset on what a point is left with is a level, which moves by so much in a
    /// second, and noise.
    pub(super) fn wandered(
        &self,
        onset: &Onset,
        wandering: &Wandering,
        m2_per_s: f64,
        left_m: impl Fn(&GagePoint) -> f64,
    ) -> f64 {
        let mut level = wandering.before(onset).clone();
        for (place, point) in self.points.iter().enumerate().skip(onset.first) {
            let noise_m2 = self.noise_m2 / point.count;
            level.take(left_m(point), self.walked(place, m2_per_s), noise_m2, []);
        }
        level.log_likelihood()
    }

    /// Of the points from each place on to the end, the deviance of a value that has no other than the gage's own noise.
    pub(super) fn own_deviances(&self, value: impl Fn(&GagePoint) -> f64) -> Vec<f64> {
        let mut sums = vec![0.0; self.points.len() + 1];
        for (place, point) in self.points.iter().enumerate().rev() {
            sums[place] = sums[place + 1] + deviance(value(point), self.own_noise_m2 / point.count);
        }
        sums
    }

    /// The filter before each point, and after the last.
    fn filters(&self, m2_per_s: f64, level: Prior) -> impl Iterator<Item = LevelFilter<0>> {
        let mut filter = LevelFilter::<0>::new(level);
        let all = self.points.iter().enumerate().map(Some).chain([None]);
        all.map(move |next| {
            let before = filter.clone();
            if let Some((place, point)) = next {
                let walked = self.walked(place, m2_per_s);
                filter.take(point.off_m, walked, self.noise_m2 / point.count, []);
            }
            before
        })
    }

    /// The ways in which the level may wander that are likely before the onset.
    fn likely_wanderings(&self, level: Prior) -> Vec<Wandering> {
        let scaled = |walk: f64| walk * walk * self.own_noise_m2;
        let walks = likely_walks(|walk| {
            let mut filters = self.filters(scaled(walk), level);
            filters.nth(self.earliest).map_or(0.0, |filter| filter.log_likelihood())
        });
        let wandering = |(walk, share): (f64, f64)| Wandering {
            share,
            m2_per_s: scaled(walk),
            before: self.filters(scaled(walk), level).collect(),
        };
        walks.into_iter().map(wandering).collect()
    }
}

fn is_before(excerpt: &Excerpt, step: &GageStep) -> bool {
    match excerpt.seen {
        FaultOnset::Change { onset, .. } => {
            step.step.0 as f64 <= onset.0 as f64 - 2.0 * FINE_BEFORE_S / excerpt.step_s
        }
        FaultOnset::Departure { .. } => false,
    }
}

/// Variance of white noise, from second differences.
fn white(steps: &[GageStep], value: impl Fn(&GageStep) -> f64) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for three in steps.windows(3) {
        let [first, second, third] = three else { continue };
        if third.step.since(first.step) == 2 {
            sum += (value(third) - 2.0 * value(second) + value(first)).powi(2) / 6.0;
            count += 1.0;
        }
    }
    (count > 10.0 && sum > 0.0 && sum.is_finite()).then(|| sum / count)
}

/// Every point up to the detection may be the first that is affected; in long ones, and in gaps, at several times.
fn onsets(points: &[GagePoint]) -> Vec<Onset> {
    let mut onsets = Vec::new();
    for (first, point) in points.iter().enumerate().filter(|(_, point)| point.from_s <= 1e-9) {
        let before = first.checked_sub(1).map_or(point.from_s, |before| points[before].until_s);
        for (from_s, until_s) in [(before, point.from_s), (point.from_s, point.until_s)] {
            if until_s - from_s > 1.5 * BLOCK_S {
                let part = (until_s.min(0.0) - from_s) / WITHIN as f64;
                onsets.extend((1..WITHIN).map(|k| Onset { first, at_s: from_s + k as f64 * part }));
            }
            if until_s <= point.from_s {
                onsets.push(Onset { first, at_s: point.from_s });
            }
        }
    }
    onsets
}

/// Means over seconds before the steps, over steps and blocks, and over seconds after them.
fn points(grouping: &Grouping, steps: &[GageStep], seconds: &[GageStep]) -> Vec<GagePoint> {
    let at_s = |step: &GageStep| grouping.at_s(step.step);
    let times: Vec<f64> = steps.iter().map(at_s).collect();
    let expected = RunningSums::new(steps.iter().map(|step| step.reading_m - step.off_m));
    let (off, reading) = (
        RunningSums::new(steps.iter().map(|step| step.off_m)),
        RunningSums::new(steps.iter().map(|step| step.reading_m)),
    );
    let near = ((NEAR_S / grouping.step_s).round() as usize).max(1);
    let point = |all: Range<usize>| GagePoint {
        from_s: times[all.start],
        until_s: times[all.end - 1],
        count: all.len() as f64,
        off_m: off.mean(all.clone()),
        reading_m: reading.mean(all.clone()),
        expected_m: expected.mean_around(all, near),
    };
    let points: Vec<GagePoint> = grouping.group(&times).into_iter().map(point).collect();
    let whole = (1.0 / grouping.step_s).round();
    let second = |mean: &GageStep| {
        let until_s = grouping.at_s(mean.step);
        GagePoint {
            from_s: until_s - 1.0 + grouping.step_s,
            until_s,
            count: whole,
            off_m: mean.off_m,
            reading_m: mean.reading_m,
            expected_m: mean.reading_m - mean.off_m,
        }
    };
    let (begin, end) = match (points.first(), points.last()) {
        (Some(first), Some(last)) => (first.from_s, last.until_s),
        _ => (f64::INFINITY, f64::INFINITY),
    };
    let all: Vec<GagePoint> = seconds.iter().map(second).collect();
    let earlier = all.iter().filter(|point| point.until_s < begin).copied();
    let later = all.iter().filter(|point| point.from_s > end).copied();
    earlier.chain(points).chain(later).collect()
}

/// RunningSums from the beginning on.
struct RunningSums(Vec<f64>);

impl RunningSums {
    fn new(values: impl Iterator<Item = f64>) -> Self {
        let mut sum = 0.0;
        let running = values.map(|value| {
            sum += value;
            sum
        });
        Self([0.0].into_iter().chain(running).collect())
    }

    fn sum(&self, of: &Range<usize>) -> f64 {
        self.0[of.end] - self.0[of.start]
    }

    fn mean(&self, of: Range<usize>) -> f64 {
        self.sum(&of) / of.len() as f64
    }

    /// The mean of the neighbours on both sides of a range, without the range itself.
    fn mean_around(&self, of: Range<usize>, near: usize) -> f64 {
        let wider = of.start.saturating_sub(near)..(of.end + near).min(self.0.len() - 1);
        match wider.len() - of.len() {
            0 => self.mean(of),
            around => (self.sum(&wider) - self.sum(&of)) / around as f64,
        }
    }
}
