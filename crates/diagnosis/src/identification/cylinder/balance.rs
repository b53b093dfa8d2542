//! A cylinder's balance of oil, chamber by chamber: what its pressures say that it holds less what its valve was commanded
//! to let in (eq. 9).
//!
//! V_A/β·(p_A − p_A(0)) − ∫q_A dt is the oil that came into chamber A in another way than commanded \[m³\]; the noise of
//! the pressure sensor is all the noise that it has, since a sum does not repeat it. Volumes and valve differ from their
//! figures, and a closed valve lets some oil through: what that makes of the balance is left open.

use std::ops::Range;

use vocabulary::SignaturePoint;

use super::flows::{self, FlowStep, FlowSums};
use crate::identification::axis::{SearchAxis, YOUNG_S};
use crate::identification::excerpt::{CylinderSeries, Excerpt};
use crate::identification::level::{LevelFilter, Prior, Walked, Weighed, likeliest_walk};
use crate::identification::mixture::Mixture;
use crate::identification::points::{FINE_BEFORE_S, Grouping};
use crate::identification::signature::signature;
use crate::residual::NominalHydraulics;

/// Volumes and valve are known within a tenth, each as likely as the other: of that, as much as of a normal with this
/// deviation, 95 % are within 0.095.
pub(super) const FIGURES: Prior = Prior { mean: 0.0, deviation: 0.0485 };
/// Where it is left aside.
const AS_COMMANDED: Prior = Prior { mean: 0.0, deviation: 1e-9 };
/// Onsets apart, at first, as a share of their age.
const APART: f64 = 0.25;
/// How likely it is that a fault ends within the series.
const HAS_ENDED: f64 = 0.02;
/// Random walk of the balance after the end, per root second, in standard deviations of a chamber's measured oil content;
/// all equally likely. The repair moves cylinder and valve in ways that the model does not describe.
const AFTER_END: [f64; 4] = [1e3, 3e3, 1e4, 3e4];
/// Ends that are tried at first, and places for them from each point to the next.
const ENDS_AT_FIRST: f64 = 24.0;
const ENDS_WITHIN: usize = 8;

/// Of a fault that does not end.
const LASTS: (f64, f64) = (f64::INFINITY, 0.0);

/// Coefficients beside that of the fault: both volumes, the valve's gain, the null flow.
const OPEN: usize = 4;
/// All coefficients, the fault's first.
const ALL: usize = OPEN + 1;

/// Means over a stretch of time; all sums are from the beginning on.
#[derive(Debug, Clone, Copy)]
pub(super) struct BalancePoint {
    at_s: f64,
    count: f64,
    /// What each chamber holds more than in the beginning, by its pressure \[m³\]; and by the points before and after.
    held: [f64; 2],
    held_near: [f64; 2],
    sums: FlowSums,
}

/// A series, ready to be weighed.
#[derive(Debug, Clone)]
pub(in crate::identification) struct OilBalance {
    pub(super) steps: Vec<FlowStep>,
    pub(super) hydraulics: NominalHydraulics,
    grouping: Grouping,
    groups: Vec<Range<usize>>,
    points: Vec<BalancePoint>,
    /// Places of points, and their axis.
    onsets: Vec<usize>,
    axis: SearchAxis,
    /// The onset that was seen, or the earliest one if none was, as a point's place.
    seen: usize,
    pub(super) noise_m6: [f64; 2],
    walk_m6_per_s: [f64; 2],
    null_flow: Prior,
    /// Called before each case that is weighed.
    pause: fn(),
}

impl OilBalance {
    /// `None` without at least two usable values.
    pub(in crate::identification) fn new(
        excerpt: &Excerpt,
        series: &CylinderSeries,
        pause: fn(),
    ) -> Option<Self> {
        let grouping = Grouping::of(excerpt);
        let h = series.hydraulics;
        let steps = flows::steps(&grouping, series);
        let first = steps.first().filter(|_| steps.len() > 1)?.pressures_pa;
        let times: Vec<f64> = steps.iter().map(|step| step.at_s).collect();
        let groups = grouping.group(&times);
        let sums = flows::sums(&h, &steps, &flows::commanded(&h, &steps));
        let capacity = [h.volume_a_m3, h.volume_b_m3].map(|volume| volume / h.bulk_modulus_pa);
        let held = |k: usize| {
            [0, 1].map(|chamber| {
                capacity[chamber] * (steps[k].pressures_pa[chamber] - first[chamber])
            })
        };
        let mut points: Vec<BalancePoint> =
            groups.iter().map(|of| mean(of.clone(), &times, &held, &sums)).collect();
        look_around(&mut points);
        let onsets: Vec<usize> = (0..points.len()).filter(|k| points[*k].at_s <= 1e-9).collect();
        let noise_m6 = capacity.map(|capacity| (capacity * h.pressure_noise_pa).powi(2));
        let earliest = points.iter().position(|point| point.at_s >= grouping.fine_from_s);
        let seen_s = grouping.fine_from_s + FINE_BEFORE_S;
        let seen = onsets.iter().copied().find(|k| points[*k].at_s >= seen_s - 1e-9);
        let mut balance = Self {
            axis: SearchAxis::of_onsets(onsets.iter().map(|k| points[*k].at_s), APART),
            seen: seen.unwrap_or(0),
            steps,
            hydraulics: h,
            grouping,
            groups,
            points,
            onsets,
            noise_m6,
            walk_m6_per_s: noise_m6.map(|noise| 0.01 * noise),
            null_flow: series.null_flow,
            pause,
        };
        balance.walk_m6_per_s = balance.wandering(earliest.unwrap_or(0));
        (!balance.onsets.is_empty()).then_some(balance)
    }

    /// Weighs a hypothesis over all onsets: by the first point that the fault affects.
    pub(super) fn over_onsets(&self, weigh: impl Fn(usize) -> Vec<Weighed>) -> Mixture {
        self.axis.integrate(|place| weigh(self.onsets[place]))
    }

    /// The same of a fault that may have ended: by the place among the points, or on the way to the next, where it did, and by how
    /// much the balance wanders then, see [`AFTER_END`].
    pub(super) fn over_onsets_and_ends(
        &self,
        weigh: impl Fn(usize, (f64, f64)) -> Vec<Weighed>,
    ) -> Mixture {
        let mut all = Mixture::default();
        all.extend(self.over_onsets(|first| weigh(first, LASTS)), 1.0 - HAS_ENDED);
        let ends: Vec<f64> = (self.seen * ENDS_WITHIN + 1..(self.points.len() - 1) * ENDS_WITHIN)
            .map(|part| part as f64 / ENDS_WITHIN as f64)
            .collect();
        // Any order of magnitude of how long it lasts is as likely as any other.
        let seen_s = self.points[self.seen].at_s;
        let lasted = |end: &f64| (self.between(*end, |point| point.at_s) - seen_s + YOUNG_S).ln();
        let lasted: Vec<f64> = ends.iter().map(lasted).collect();
        let span = lasted.last().map_or(0.0, |last| last - lasted[0]);
        let axis = SearchAxis::new(lasted, span / ENDS_AT_FIRST);
        let lasts = Mixture::of_equals(weigh(self.seen, LASTS)).log_likelihood();
        let ended = self.over_onsets_and(&axis, lasts, |first, place| {
            let end = ends[place];
            let cases = AFTER_END.into_iter().flat_map(|after| weigh(first, (end, after)));
            cases.map(|case| Weighed { end, ..case }).collect()
        });
        all.extend(ended, HAS_ENDED);
        all
    }

    /// Weighs a hypothesis over all onsets and over the places along another axis: over these given the onset that was
    /// seen, and over the onsets given the likeliest of these, as if what is likely of one did not depend on the other.
    /// Nothing, if it is less likely than this given the onset that was seen.
    pub(super) fn over_onsets_and(
        &self,
        axis: &SearchAxis,
        least: f64,
        weigh: impl Fn(usize, usize) -> Vec<Weighed>,
    ) -> Mixture {
        let places = axis.integrate(|place| weigh(self.seen, place));
        let mut both = Mixture::default();
        if let Some(best) = places.likeliest().filter(|_| places.log_likelihood() >= least) {
            let at_best = Mixture::of_equals(weigh(self.seen, best.place));
            let share = (places.log_likelihood() - at_best.log_likelihood()).exp();
            both.extend(self.over_onsets(|first| weigh(first, best.place)), share);
        }
        both
    }

    /// What points have at a place among them, or on the way from one to the next.
    fn between(&self, place: f64, of: impl Fn(&BalancePoint) -> f64) -> f64 {
        let (whole, part) = (place.floor() as usize, place.fract());
        let before = of(&self.points[whole]);
        let next = self.points.get(whole + 1).filter(|_| part > 0.0);
        next.map_or(before, |next| before + part * (of(next) - before))
    }

    /// Some of the onsets, so many at most, and when they are \[s\].
    pub(super) fn some_onsets(&self, most: usize) -> Vec<f64> {
        let coarse: Vec<f64> =
            self.axis.coarse().iter().map(|k| self.points[self.onsets[*k]].at_s).collect();
        let every = coarse.len().div_ceil(most).max(1);
        coarse.into_iter().rev().step_by(every).collect()
    }

    /// What both chambers say of a fault that begins with a point and ends at a place: `sum` is what it would have done to each
    /// chamber from the beginning on.
    pub(super) fn during(
        &self,
        first: usize,
        (end, after): (f64, f64),
        sum: impl Fn(&FlowSums) -> [f64; 2],
    ) -> LevelFilter<ALL> {
        let afterwards = self.noise_m6.map(|noise| after * after * noise);
        let walk = |place: usize| if place as f64 > end { afterwards } else { self.walk_m6_per_s };
        self.follow(self.points.len(), walk, |place, point| {
            let until = |place: usize, k: usize| {
                self.between(end.max(first as f64).min(place as f64), |point| sum(&point.sums)[k])
            };
            let effect = |k| if place < first { 0.0 } else { until(place, k) - until(first, k) };
            (point.sums.oil, [0, 1].map(effect))
        })
    }

    /// Filters both chambers' balance, which from a point on is a random walk in the affected chambers, of this many standard
    /// deviations of the measured oil content per root second.
    pub(super) fn wandering_since(
        &self,
        first: usize,
        affected: [bool; 2],
        deviations: f64,
    ) -> LevelFilter<ALL> {
        let usual = self.walk_m6_per_s;
        let afterwards = [0, 1].map(|k| {
            if affected[k] { deviations * deviations * self.noise_m6[k] } else { usual[k] }
        });
        let walk = |place: usize| if place < first { usual } else { afterwards };
        self.follow(self.points.len(), walk, |_, point| (point.sums.oil, [0.0; 2]))
    }

    /// Filters both chambers' balance, given the valve's flow at each step \[m³/s\]. The spool's position may be wrong: at the
    /// end by the share `wrong` of the flow's effect on the balance. A displaced spool moves oil from one chamber to the
    /// other, so this error cancels in the sum of both chambers. The sum and a weighted difference are filtered; the weights
    /// make their noise independent.
    pub(super) fn with_valve(&self, flow: &[f64], wrong: f64) -> LevelFilter<ALL> {
        (self.pause)();
        let let_in = flows::oil(&self.hydraulics, &self.steps, flow);
        let mean = |of: &Range<usize>, k: usize| {
            let_in[of.clone()].iter().map(|oil| oil[k]).sum::<f64>() / of.len() as f64
        };
        let means: Vec<[f64; 2]> =
            self.groups.iter().map(|of| [0, 1].map(|k| mean(of, k))).collect();
        let off = |(point, mean): (&BalancePoint, &[f64; 2])| (mean[0] - point.sums.oil[0]).abs();
        let departure_m3 = self.points.iter().zip(&means).map(off).fold(0.0, f64::max);
        let all_s = self.points[self.points.len() - 1].at_s - self.points[0].at_s;
        let displaced_m6_per_s = (wrong * departure_m3).powi(2) / all_s.max(self.grouping.step_s);

        let [of_a, of_b] = self.noise_m6.map(|noise| noise / (self.noise_m6[0] + self.noise_m6[1]));
        let turned = |[a, b]: [f64; 2]| [of_b * a - of_a * b, a + b];
        let variances = |[a, b]: [f64; 2]| [of_b * of_b * a + of_a * of_a * b, a + b];
        let noise_m6 = variances(self.noise_m6);
        let walk_m6_per_s = variances(self.walk_m6_per_s);
        let walk_m6_per_s = [walk_m6_per_s[0] + displaced_m6_per_s, walk_m6_per_s[1]];
        let mut levels = noise_m6.map(first_level);
        let mut before = self.points[0];
        for (point, let_in) in self.points.iter().zip(means) {
            let unsure = |k: usize| (point.sums.unsure[k] - before.sums.unsure[k]).powi(2);
            let unsure_m6 = variances([unsure(0), unsure(1)]);
            let held = turned([0, 1].map(|k| point.held[k] - let_in[k]));
            let volumes = [turned([-point.held_near[0], 0.0]), turned([0.0, -point.held_near[1]])];
            let (let_in, null) = (turned(let_in), turned(point.sums.null));
            for (k, level) in levels.iter_mut().enumerate() {
                let walked = walk_m6_per_s[k] * (point.at_s - before.at_s) + unsure_m6[k];
                let regressors = [0.0, volumes[0][k], volumes[1][k], let_in[k], null[k]];
                let noise = noise_m6[k] / point.count;
                level.take(held[k], Walked::before(walked), noise, regressors);
            }
            before = *point;
        }
        levels[0].together(&levels[1])
    }

    /// What a chamber was seen to hold more than its valve was commanded to let in, and what a case makes of it, given how
    /// much a fault of coefficient one adds until a point.
    pub(super) fn signature(
        &self,
        best: &Weighed,
        chamber: usize,
        sum: impl Fn(&FlowSums) -> f64,
    ) -> Vec<SignaturePoint> {
        let sum = |place: f64| self.between(place, |point| sum(&point.sums));
        self.drawn(best, chamber, |first, place, _| {
            best.mean * (sum(best.end.max(first as f64).min(place as f64)) - sum(first as f64))
        })
    }

    /// The signature of a fault without a model: the fit is what was measured.
    pub(super) fn as_measured(&self, best: &Weighed) -> Vec<SignaturePoint> {
        self.drawn(best, 0, |_, _, measured| measured)
    }

    /// What was measured, and what is fitted to it after an onset, by the places of its first point and of a point.
    fn drawn(
        &self,
        best: &Weighed,
        chamber: usize,
        fitted: impl Fn(usize, usize, f64) -> f64,
    ) -> Vec<SignaturePoint> {
        let Some(first) = self.onsets.get(best.place).copied() else { return Vec::new() };
        let at = |(place, point): (usize, &BalancePoint)| {
            let measured = point.held[chamber] - point.sums.oil[chamber];
            let after = if place < first { 0.0 } else { fitted(first, place, measured) };
            (point.at_s, measured, after)
        };
        let series: Vec<_> = self.points.iter().enumerate().map(at).collect();
        signature(&series, self.points[first].at_s, |at_s| self.grouping.step_at(at_s))
    }

    /// The same of a valve that let through what is given for each step \[m³/s\], of chamber A.
    pub(super) fn valve_signature(&self, flow: &[f64], onset_s: f64) -> Vec<SignaturePoint> {
        let oil = flows::oil(&self.hydraulics, &self.steps, flow);
        let mut begun = None;
        let mut at = |(of, point): (&Range<usize>, &BalancePoint)| {
            let count = of.len() as f64;
            let let_in = oil[of.clone()].iter().map(|oil| oil[0]).sum::<f64>() / count;
            let more = let_in - point.sums.oil[0];
            let after = if point.at_s < onset_s { 0.0 } else { more - *begun.get_or_insert(more) };
            (point.at_s, point.held[0] - point.sums.oil[0], after)
        };
        let series: Vec<_> = self.groups.iter().zip(&self.points).map(&mut at).collect();
        signature(&series, onset_s, |at_s| self.grouping.step_at(at_s))
    }

    /// Weighs a filter with each of these priors of the fault's coefficient. Deviations of the valve's flow from its
    /// figures are neglected: the accumulated flow contains the noise of every pressure, so its gain would be estimated
    /// too small, and with it every other term of the oil balance.
    pub(super) fn weigh(&self, level: &LevelFilter<ALL>, priors: &[Prior]) -> Vec<Weighed> {
        let all = |of_fault: &Prior| [*of_fault, FIGURES, FIGURES, AS_COMMANDED, self.null_flow];
        priors.iter().filter_map(|of_fault| level.weigh(&all(of_fault))).collect()
    }

    /// The same where the valve does not follow the pressures: its gain is open.
    pub(super) fn weigh_valve(&self, level: &LevelFilter<ALL>, of_fault: Prior) -> Option<Weighed> {
        level.weigh(&[of_fault, FIGURES, FIGURES, FIGURES, self.null_flow])
    }

    /// Goes through the first `count` points; `walk_m6_per_s` tells by how much the balance wanders before each, `at` the
    /// oil let in and the fault's effect on each chamber.
    fn follow(
        &self,
        count: usize,
        walk_m6_per_s: impl Fn(usize) -> [f64; 2],
        at: impl Fn(usize, &BalancePoint) -> ([f64; 2], [f64; 2]),
    ) -> LevelFilter<ALL> {
        (self.pause)();
        let mut levels = self.noise_m6.map(first_level);
        let mut before = self.points[0];
        for (place, point) in self.points.iter().enumerate().take(count) {
            let (oil, effect) = at(place, point);
            let walk_m6_per_s = walk_m6_per_s(place);
            for (k, level) in levels.iter_mut().enumerate() {
                let [a, b] = [0, 1].map(|own| if own == k { -point.held_near[k] } else { 0.0 });
                let regressors = [effect[k], a, b, oil[k], point.sums.null[k]];
                let unsure = point.sums.unsure[k] - before.sums.unsure[k];
                let walked = walk_m6_per_s[k] * (point.at_s - before.at_s) + unsure * unsure;
                level.take(
                    point.held[k] - oil[k],
                    Walked::before(walked),
                    self.noise_m6[k] / point.count,
                    regressors,
                );
            }
            before = *point;
        }
        levels[0].together(&levels[1])
    }

    /// How much the balance wanders in a second, by what is likeliest before the onset \[m⁶\].
    fn wandering(&self, earliest: usize) -> [f64; 2] {
        let scaled = |walk: f64| self.noise_m6.map(|noise| walk * walk * noise);
        scaled(likeliest_walk(earliest, |walk| {
            let walk = |_: usize| scaled(walk);
            let level = self.follow(earliest, walk, |_, point| (point.sums.oil, [0.0; 2]));
            let weighed = self.weigh(&level, &[Prior::about_zero(1.0)]);
            weighed.first().map_or(f64::NEG_INFINITY, |weighed| weighed.log_likelihood)
        }))
    }
}

/// Before the first value: its noise is in all that follows.
fn first_level(noise_m6: f64) -> LevelFilter<ALL> {
    LevelFilter::new(Prior::about_zero(2.0 * noise_m6.sqrt()))
}

fn mean(
    of: Range<usize>,
    times: &[f64],
    held: &impl Fn(usize) -> [f64; 2],
    sums: &[FlowSums],
) -> BalancePoint {
    let count = of.len() as f64;
    let mean = |value: &dyn Fn(usize) -> f64| of.clone().map(value).sum::<f64>() / count;
    let held = [0, 1].map(|chamber| mean(&|k| held(k)[chamber]));
    BalancePoint {
        at_s: mean(&|k| times[k]),
        count,
        held,
        held_near: held,
        sums: FlowSums {
            oil: [0, 1].map(|chamber| mean(&|k| sums[k].oil[chamber])),
            null: [0, 1].map(|chamber| mean(&|k| sums[k].null[chamber])),
            leaks: [0, 1, 2].map(|leak| mean(&|k| sums[k].leaks[leak])),
            wide_open: mean(&|k| sums[k].wide_open),
            unsure: [0, 1].map(|chamber| mean(&|k| sums[k].unsure[chamber])),
        },
    }
}

/// What a chamber holds is in the balance already, with the noise of its pressure: by that alone the balance would fit best
/// if its volume were nothing. So what it holds by the points before and after goes with the volume.
fn look_around(points: &mut [BalancePoint]) {
    let known: Vec<(f64, [f64; 2])> = points.iter().map(|p| (p.at_s, p.held)).collect();
    for (place, point) in points.iter_mut().enumerate() {
        let before = known[place.saturating_sub(1)];
        let after = known[(place + 1).min(known.len() - 1)];
        let width = after.0 - before.0;
        let share = if width > 0.0 { (point.at_s - before.0) / width } else { 0.0 };
        point.held_near = [0, 1].map(|k| before.1[k] + share * (after.1[k] - before.1[k]));
    }
}

#[cfg(test)]
mod tests {
    use vocabulary::{RunId, Step};

    use super::*;
    use crate::identification::excerpt::CylinderStep;
    use crate::identification::{FaultOnset, MeasuredSeries};
    use crate::testing::hydraulics;

    /// Pressures that follow nothing, far from supply and tank.
    fn balance() -> OilBalance {
        let step = |step: u64| {
            let wave = |pace: f64| (pace * (step * step) as f64).sin();
            let pressures_pa = [8e6 + 1e4 * wave(2.4), 9e6 + 1e4 * wave(1.7)];
            CylinderStep { step: Step(step), demand_n: 2e3 * wave(0.3), pressures_pa }
        };
        let series = CylinderSeries {
            steps: (0..60).map(step).collect(),
            hydraulics: hydraulics(),
            null_flow: Prior::about_zero(1e-9),
        };
        let excerpt = Excerpt {
            run: RunId(1),
            sequence: 1,
            component: "actuator/a1".parse().unwrap(),
            as_of: Step(60),
            step_s: 1e-3,
            seen: FaultOnset::Change { onset: Step(30), detection: Step(40) },
            measured: MeasuredSeries::Cylinder(series.clone()),
        };
        OilBalance::new(&excerpt, &series, || ()).unwrap()
    }

    /// What is weighed of a valve that let through what was commanded, with something added to what the chambers hold at the
    /// end.
    fn as_commanded(balance: &OilBalance, added_m3: [f64; 2], wrong: f64) -> f64 {
        let mut balance = balance.clone();
        let last = balance.points.len() - 1;
        for k in [0, 1] {
            balance.points[last].held[k] += added_m3[k];
        }
        let flow: Vec<f64> = balance.steps.iter().map(|step| 1.1 * step.commanded).collect();
        let level = balance.with_valve(&flow, wrong);
        balance.weigh_valve(&level, Prior::about_zero(1.0)).unwrap().log_likelihood
    }

    #[test]
    fn without_error_sum_and_difference_say_of_a_valve_what_the_two_chambers_say() {
        let mut balance = balance();
        // What flows is known: otherwise it is uncertain by another share of each chamber's noise.
        balance.points.iter_mut().for_each(|point| point.sums.unsure = [0.0; 2]);
        let turned = as_commanded(&balance, [0.0; 2], 0.0);
        let flow: Vec<f64> = balance.steps.iter().map(|step| 1.1 * step.commanded).collect();
        let let_in = flows::oil(&balance.hydraulics, &balance.steps, &flow);
        for (point, of) in balance.points.iter_mut().zip(&balance.groups) {
            let count = of.len() as f64;
            point.sums.oil =
                [0, 1].map(|k| let_in[of.clone()].iter().map(|oil| oil[k]).sum::<f64>() / count);
        }
        let level = balance.during(0, LASTS, |_| [0.0; 2]);
        let plain = balance.weigh_valve(&level, Prior::about_zero(1.0)).unwrap().log_likelihood;
        assert!((turned - plain).abs() < 1e-6 * plain.abs(), "{turned} {plain}");
    }

    #[test]
    fn a_displaced_spool_may_move_oil_from_one_chamber_to_the_other_but_add_none() {
        let balance = balance();
        let much_m3 = 100.0 * balance.noise_m6[0].sqrt();
        let gained = |added: [f64; 2]| {
            as_commanded(&balance, added, 1.0) - as_commanded(&balance, added, 0.0)
        };
        let [moved, added] = [gained([much_m3, -much_m3]), gained([much_m3, much_m3])];
        assert!(moved > 10.0 && moved > 10.0 * added, "{moved} {added}");
    }
}
