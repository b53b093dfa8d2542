//! A cylinder's balance of oil, chamber by chamber: what its pressures say that it holds less what its valve was commanded
//! to let in (eq. 9).
//!
//! V_A/β·(p_A − p_A(0)) − ∫q_A dt is the oil that came into chamber A in another way than commanded \[m³\]; the noise of
//! the pressure sensor is all the noise that it has, since a sum does not repeat it. Volumes and valve differ from their
//! figures, and a closed valve lets some oil through: what that makes of the balance is left open.

use std::ops::Range;

use vocabulary::SignaturePoint;

use super::flows::{self, FlowStep, FlowSums};
use crate::identification::axis::SearchAxis;
use crate::identification::excerpt::{CylinderSeries, Excerpt};
use crate::identification::level::{LevelFilter, Prior, Walked, Weighed, likeliest_walk};
use crate::identification::mixture::Mixture;
use crate::identification::points::Grouping;
use crate::identification::signature::signature;
use crate::residual::NominalHydraulics;

/// Volumes and valve are known within a tenth, each as likely as the other: of that, as much as of a normal with this
/// deviation, 95 % are within 0.095.
pub(super) const FIGURES: Prior = Prior { mean: 0.0, deviation: 0.0485 };
/// Where it is left aside.
const AS_COMMANDED: Prior = Prior { mean: 0.0, deviation: 1e-9 };
/// Onsets apart, at first, as a share of their age.
const APART: f64 = 0.25;

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
    noise_m6: [f64; 2],
    walk_m6_per_s: [f64; 2],
    null_flow: Prior,
}

impl OilBalance {
    /// `None` without at least two usable values.
    pub(in crate::identification) fn new(
        excerpt: &Excerpt,
        series: &CylinderSeries,
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
        let mut balance = Self {
            axis: SearchAxis::of_onsets(onsets.iter().map(|k| points[*k].at_s), APART),
            steps,
            hydraulics: h,
            grouping,
            groups,
            points,
            onsets,
            noise_m6,
            walk_m6_per_s: noise_m6.map(|noise| 0.01 * noise),
            null_flow: series.null_flow,
        };
        balance.walk_m6_per_s = balance.wandering(earliest.unwrap_or(0));
        (!balance.onsets.is_empty()).then_some(balance)
    }

    /// Weighs a hypothesis over all onsets: by the first point that the fault affects.
    pub(super) fn over_onsets(&self, weigh: impl Fn(usize) -> Vec<Weighed>) -> Mixture {
        self.axis.integrate(|place| weigh(self.onsets[place]))
    }

    /// Some of the onsets, so many at most, and when they are \[s\].
    pub(super) fn some_onsets(&self, most: usize) -> Vec<f64> {
        let coarse: Vec<f64> =
            self.axis.coarse().iter().map(|k| self.points[self.onsets[*k]].at_s).collect();
        let every = coarse.len().div_ceil(most).max(1);
        coarse.into_iter().rev().step_by(every).collect()
    }

    /// What both chambers say of a fault that begins with a point: `sum` is what it would have done to each chamber from the
    /// beginning on.
    pub(super) fn since(
        &self,
        first: usize,
        sum: impl Fn(&FlowSums) -> [f64; 2],
    ) -> LevelFilter<ALL> {
        let begun = sum(&self.points[first].sums);
        self.follow(self.points.len(), self.walk_m6_per_s, |place, point| {
            let now = sum(&point.sums);
            let effect = [0, 1].map(|k| if place < first { 0.0 } else { now[k] - begun[k] });
            (point.sums.oil, effect)
        })
    }

    /// What both chambers say if the valve let through what is given for each step \[m³/s\], and nothing else is wrong.
    pub(super) fn with_valve(&self, flow: &[f64]) -> LevelFilter<ALL> {
        let oil = flows::oil(&self.hydraulics, &self.steps, flow);
        self.follow(self.points.len(), self.walk_m6_per_s, |place, _| {
            let of = &self.groups[place];
            let mean = |k: usize| oil[of.clone()].iter().map(|oil| oil[k]).sum::<f64>();
            ([0, 1].map(|k| mean(k) / of.len() as f64), [0.0; 2])
        })
    }

    /// What a chamber was seen to hold more than its valve was commanded to let in, and what a case makes of it, given how
    /// much a fault of coefficient one adds until a point.
    pub(super) fn signature(
        &self,
        best: &Weighed,
        chamber: usize,
        sum: impl Fn(&FlowSums) -> f64,
    ) -> Vec<SignaturePoint> {
        let Some(first) = self.onsets.get(best.place).map(|place| &self.points[*place]) else {
            return Vec::new();
        };
        let begun = sum(&first.sums);
        let at = |point: &BalancePoint| {
            let after = if point.at_s < first.at_s { 0.0 } else { sum(&point.sums) - begun };
            (point.at_s, point.held[chamber] - point.sums.oil[chamber], best.mean * after)
        };
        let series: Vec<_> = self.points.iter().map(at).collect();
        signature(&series, first.at_s, |at_s| self.grouping.step_at(at_s))
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

    /// Goes through the first `count` points; `at` tells the oil let in and the fault's effect on each chamber.
    fn follow(
        &self,
        count: usize,
        walk_m6_per_s: [f64; 2],
        at: impl Fn(usize, &BalancePoint) -> ([f64; 2], [f64; 2]),
    ) -> LevelFilter<ALL> {
        // The first pressure's noise is in all that follows.
        let start = |k: usize| LevelFilter::new(Prior::about_zero(2.0 * self.noise_m6[k].sqrt()));
        let mut levels: [LevelFilter<ALL>; 2] = [start(0), start(1)];
        let mut before = self.points[0];
        for (place, point) in self.points.iter().enumerate().take(count) {
            let (oil, effect) = at(place, point);
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
            let level = self.follow(earliest, scaled(walk), |_, point| (point.sums.oil, [0.0; 2]));
            let weighed = self.weigh(&level, &[Prior::about_zero(1.0)]);
            weighed.first().map_or(f64::NEG_INFINITY, |weighed| weighed.log_likelihood)
        }))
    }
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
