//! What can be wrong with a cylinder. Small hypotheses stand here; a sticking valve has a file of its own.

pub(super) mod balance;
mod flows;
mod stiction;

use vocabulary::{FaultSize, IdentifiedKind, IdentifiedKind::Known, fault::FaultKind};

use self::balance::{FIGURES, OilBalance};
use super::axis::SearchAxis;
use super::level::Prior;
use super::mixture::Mixture;
use super::{Hypothesis, NONE_PRIOR};

/// All of them.
pub(super) const HYPOTHESES: [Hypothesis<OilBalance>; 6] = [
    INTERNAL_LEAKAGE,
    EXTERNAL_LEAKAGE_A,
    EXTERNAL_LEAKAGE_B,
    HARD_OVER,
    stiction::HYPOTHESIS,
    NONE_OF_THESE,
];

/// Coefficients of leaks \[m²\]: any order of magnitude is as likely as any other.
const AREAS_M2: [f64; 5] = [1e-9, 1e-8, 1e-7, 1e-6, 1e-5];
/// Random walk of the balance per root second, in standard deviations of a chamber's measured oil content; all equally
/// likely.
const WALKS: [f64; 8] = [30.0, 100.0, 300.0, 1e3, 3e3, 1e4, 3e4, 1e5];
/// Which chambers wander, each as likely as the others.
const AFFECTED: [[bool; 2]; 3] = [[true, true], [true, false], [false, true]];
/// An open inlet is as far open as its figures say, within a tenth.
const OPEN: Prior = Prior { mean: 1.0, deviation: 0.05 };

/// Oil leaks from chamber A into chamber B (eq. 10): what A lacks, B has too much; the coefficient \[m²\].
const INTERNAL_LEAKAGE: Hypothesis<OilBalance> = Hypothesis {
    kind: Known(FaultKind::InternalLeakage),
    prior: 1.0,
    weigh: |balance| leak(balance, |[across, _, _]| [-across, across]),
    show: |balance, best| balance.signature(best, 0, |sums| -sums.leaks[0]),
};

/// A chamber leaks to the outside (eq. 11): it lacks what the other has not; the coefficient \[m²\].
const EXTERNAL_LEAKAGE_A: Hypothesis<OilBalance> = Hypothesis {
    kind: Known(FaultKind::ExternalLeakageA),
    prior: 1.0,
    weigh: |balance| leak(balance, |[_, of_a, _]| [-of_a, 0.0]),
    show: |balance, best| balance.signature(best, 0, |sums| -sums.leaks[1]),
};

const EXTERNAL_LEAKAGE_B: Hypothesis<OilBalance> = Hypothesis {
    kind: Known(FaultKind::ExternalLeakageB),
    prior: 1.0,
    weigh: |balance| leak(balance, |[_, _, of_b]| [0.0, -of_b]),
    show: |balance, best| balance.signature(best, 1, |sums| -sums.leaks[2]),
};

/// The inlet of chamber A is fully open, whatever is commanded.
const HARD_OVER: Hypothesis<OilBalance> = Hypothesis {
    kind: Known(FaultKind::HardOver),
    prior: 1.0,
    weigh: |balance| {
        let cases = balance.over_onsets_and_ends(|first, end| {
            let level = balance.during(first, end, |sums| [sums.wide_open, 0.0]);
            balance.weigh_valve(&level, OPEN).into_iter().collect()
        });
        (cases, None)
    },
    show: |balance, best| balance.signature(best, 0, |sums| sums.wide_open),
};

/// None of these: from the onset on oil comes and goes in any way, in both chambers or in one, by as much in a second as is
/// likeliest.
const NONE_OF_THESE: Hypothesis<OilBalance> = Hypothesis {
    kind: IdentifiedKind::NoneOfThese,
    prior: NONE_PRIOR,
    weigh: |balance| {
        let axis = SearchAxis::new(WALKS.map(f64::ln).to_vec(), 0.0);
        let mut all = Mixture::default();
        for affected in AFFECTED {
            let cases = balance.over_onsets_and(&axis, f64::NEG_INFINITY, |first, place| {
                let level = balance.wandering_since(first, affected, WALKS[place]);
                balance.weigh_valve(&level, Prior::about_zero(1.0)).into_iter().collect()
            });
            all.extend(cases, 1.0 / AFFECTED.len() as f64);
        }
        (all, None)
    },
    show: |balance, best| balance.as_measured(best),
};

/// A leak whose hole of one square metre lets this into A and into B, given what flows through each of the three.
fn leak(balance: &OilBalance, into: impl Fn([f64; 3]) -> [f64; 2]) -> (Mixture, Option<FaultSize>) {
    let priors = AREAS_M2.map(Prior::about_zero);
    let cases = balance.over_onsets_and_ends(|first, end| {
        let level = balance.during(first, end, |sums| into(sums.leaks));
        let mut weighed = balance.weigh(&level, &priors);
        // A leak only lets oil out: a coefficient below 0 is impossible.
        for case in &mut weighed {
            if case.mean <= 0.0 {
                case.log_likelihood = f64::NEG_INFINITY;
            }
        }
        weighed
    });
    // What makes up for the leak is known as well as the valve.
    cases.sized(|leak| FIGURES.deviation * leak)
}
