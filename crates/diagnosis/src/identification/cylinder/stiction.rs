//! The valve's spool sticks where it is until the flow commanded is farther from that than a band, and then jumps there;
//! the band \[m³/s\].

use vocabulary::{FaultSize, IdentifiedKind::Known, SignaturePoint, fault::FaultKind};

use super::balance::OilBalance;
use crate::identification::Hypothesis;
use crate::identification::axis::SearchAxis;
use crate::identification::level::{Prior, Weighed};
use crate::identification::mixture::Mixture;

pub(super) const HYPOTHESIS: Hypothesis<OilBalance> =
    Hypothesis { kind: Known(FaultKind::Stiction), prior: 1.0, weigh, show };

/// Bands as shares of the open valve's flow; all orders of magnitude are equally likely.
const BANDS: [f64; 2] = [0.003, 0.3];
/// Bands that are tried at most, and at first.
const PLACES: usize = 400;
const AT_FIRST: f64 = 14.0;
/// Onsets that are tried for each: where the spool stood when it began to stick matters little.
const ONSETS: usize = 4;
/// By how much more or less than a sticking spool the real one makes of the balance, as a share of that, and how likely it
/// is that it does: one that slips a step sooner or later is elsewhere from then on.
const MODEL_ERRORS: [f64; 4] = [0.03, 0.1, 0.3, 1.0];
const IS_WRONG: f64 = 0.5;

fn weigh(balance: &OilBalance) -> (Mixture, Option<FaultSize>) {
    let [least, most] = BANDS.map(f64::ln);
    let at = |place: usize| least + (most - least) * place as f64 / (PLACES - 1) as f64;
    let axis = SearchAxis::new((0..PLACES).map(at).collect(), 0.99 * (most - least) / AT_FIRST);
    let onsets = balance.some_onsets(ONSETS);
    let mut all = Mixture::default();
    for onset in &onsets {
        let cases = axis.integrate(|place| {
            let band = at(place).exp() * balance.hydraulics.valve_flow_m3_per_s;
            let level = balance.with_valve(&spool(balance, *onset, band), 0.0);
            let weighed = balance.weigh_valve(&level, Prior::about_zero(1.0)).into_iter();
            weighed.map(|case| Weighed { mean: band, variance: 0.0, ..case }).collect()
        });
        all.extend(cases, 1.0 / onsets.len() as f64);
    }
    let best = all.likeliest();
    let mut either = Mixture::default();
    either.extend(all, 1.0 - IS_WRONG);
    for (onset, best) in onsets.iter().zip(best.into_iter().cycle()) {
        let spool = spool(balance, *onset, best.mean);
        for wrong in MODEL_ERRORS {
            let level = balance.with_valve(&spool, wrong);
            let case = balance.weigh_valve(&level, Prior::about_zero(1.0)).into_iter();
            let case = case.map(|case| Weighed { mean: best.mean, variance: 0.0, ..case });
            // Of the bands, only the likeliest is tried.
            let tried = (onsets.len() * MODEL_ERRORS.len()) as f64 * AT_FIRST;
            either.extend(Mixture::of_equals(case.collect()), IS_WRONG / tried);
        }
    }
    // The band itself is known to an order of magnitude only: the spool is followed by what the pressures were measured to be
    // once in a step, and one that has not jumped yet may have any.
    (either, None)
}

/// By how much more oil came into chamber A than was commanded, and by how much more a spool that sticks lets in.
fn show(balance: &OilBalance, best: &Weighed) -> Vec<SignaturePoint> {
    let onset_s = balance.some_onsets(1).first().copied().unwrap_or_default();
    balance.valve_signature(&spool(balance, onset_s, best.mean), onset_s)
}

/// What the valve lets through at each step.
fn spool(balance: &OilBalance, onset_s: f64, band: f64) -> Vec<f64> {
    let mut position = 0.0;
    let follow = |step: &super::flows::FlowStep| {
        if step.at_s < onset_s || (step.commanded - position).abs() > band {
            position = step.commanded;
        }
        position
    };
    balance.steps.iter().map(follow).collect()
}
