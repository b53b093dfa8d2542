//! What kind of fault it is, and how large: fault identification, after detection and isolation.
//!
//! The series around the onset ([`Excerpt`]) is weighed under every kind that the component can have: a gage by how much
//! more it reads than the other gages and the forces say, a cylinder by both chambers' balance of oil. Each
//! hypothesis says what it does to the series, how likely it is beforehand and how large it may be; what it leaves
//! open (onset, size) is integrated out, so that a hypothesis that fits anything gains nothing by that (marginal
//! likelihood). From the likelihoods and the priors follow the probabilities of the kinds. One hypothesis is that it is
//! none of them: whatever was measured wanders in a way of its own from the onset on. Since that explains any series a
//! little, a kind is rejected only if what it leaves unexplained is more than its model may be wrong by.
//!
//! A channel of a learned module has no such hypotheses: its kind is fitted to what it is displaced by (`state/learned`).

mod axis;
mod cylinder;
mod excerpt;
mod gage;
mod level;
mod mixture;
mod points;
mod signature;

#[cfg(test)]
mod any_series_test;

use vocabulary::{
    Candidate, Component, FaultSize, IdentifiedKind, RunId, SignaturePoint, Step, fault::FaultKind,
};

use cylinder::balance::OilBalance;
pub use excerpt::Excerpt;
pub(crate) use excerpt::{
    CylinderSeries, CylinderStep, FaultOnset, GageSeries, GageStep, MeasuredSeries,
};
use gage::record::GageRecord;
pub(crate) use level::Prior;
use level::Weighed;
use mixture::Mixture;

/// A kind is decided when it is at least so probable.
pub const DECIDED: f64 = 0.95;
/// Kinds below this are not mentioned.
const MENTIONED: f64 = 0.01;
/// How likely it is beforehand that a fault is of none of the kinds, in comparison with one of them. Seldom enough that a
/// slow process does not rival the bias that it resembles.
const NONE_PRIOR: f64 = 0.001;
/// Until a fault has been watched for so long \[s\], none of the kinds is at most as likely as all of them together: what is
/// left of the first few points may still be chance, most of all while a valve's spool has not slipped yet.
const NONE_FROM_S: f64 = 0.5;

/// A kind of fault as a hypothesis about series of this type.
struct Hypothesis<Series> {
    kind: IdentifiedKind,
    /// How likely it is beforehand, in comparison with the others of its component.
    prior: f64,
    /// Its cases (what it leaves open, integrated out by their sum), and its size, if it has one.
    weigh: fn(&Series) -> (Mixture, Option<FaultSize>),
    /// The measured series and the fit of its likeliest case.
    show: fn(&Series, &Weighed) -> Vec<SignaturePoint>,
}

/// What kind of fault it may be, and how large, as of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct IdentificationResult {
    /// The run that the step is counted in.
    pub run: RunId,
    /// The number of the transition that declared the component faulty.
    pub sequence: u64,
    /// The component.
    pub component: Component,
    /// The latest step that counts.
    pub as_of: Step,
    /// What it may be, the most probable first.
    pub candidates: Vec<Candidate>,
    /// What was measured around the onset, and what the most probable kind makes of it; empty if nothing of it is kept.
    pub signature: Vec<SignaturePoint>,
}

impl IdentificationResult {
    /// The kind, if it is decided.
    #[must_use]
    pub fn decided(&self) -> Option<&Candidate> {
        self.candidates.first().filter(|first| first.probability >= DECIDED)
    }
}

/// Identifies a fault. `without` leaves a hypothesis out, to measure how faults of an unknown kind are reported; the
/// diagnoser passes `None`.
#[must_use]
pub fn identify(excerpt: &Excerpt, without: Option<FaultKind>) -> IdentificationResult {
    identify_in_pieces(excerpt, without, || ())
}

/// Identifies a fault in the same way, and calls `pause` again and again, where a thread beside others that are in a hurry
/// can let them go first: it takes milliseconds in all.
#[must_use]
pub fn identify_in_pieces(
    excerpt: &Excerpt,
    without: Option<FaultKind>,
    pause: fn(),
) -> IdentificationResult {
    let watched_s = excerpt.as_of.since(excerpt.seen.detection()) as f64 * excerpt.step_s;
    let is_early = watched_s < NONE_FROM_S;
    let (candidates, signature) = match &excerpt.measured {
        MeasuredSeries::Gage(series) => GageRecord::new(excerpt, series, pause)
            .map(|record| weigh(&record, &gage::HYPOTHESES, without, is_early)),
        MeasuredSeries::Cylinder(series) => OilBalance::new(excerpt, series, pause)
            .map(|balance| weigh(&balance, &cylinder::HYPOTHESES, without, is_early)),
        MeasuredSeries::Displaced(channel) => {
            channel.fit().map(|fitted| (vec![fitted.candidate()], Vec::new()))
        }
        MeasuredSeries::Nothing => {
            let kind = match without {
                Some(FaultKind::NoSignal) => IdentifiedKind::NoneOfThese,
                _ => IdentifiedKind::Known(FaultKind::NoSignal),
            };
            Some((vec![Candidate { kind, probability: 1.0, size: None }], Vec::new()))
        }
    }
    .unwrap_or_default();
    IdentificationResult {
        run: excerpt.run,
        sequence: excerpt.sequence,
        component: excerpt.component.clone(),
        as_of: excerpt.as_of,
        candidates,
        signature,
    }
}

/// The probabilities of kinds by Bayes' rule, the most probable first, and what was measured beside what that one makes of
/// it. A kind whose size may be that of a healthy component is none that was identified: its share goes to no other.
fn weigh<Series>(
    series: &Series,
    hypotheses: &[Hypothesis<Series>],
    without: Option<FaultKind>,
    is_early: bool,
) -> (Vec<Candidate>, Vec<SignaturePoint>) {
    let weigh = |hypothesis| {
        let Hypothesis { prior, weigh, .. }: &Hypothesis<Series> = hypothesis;
        let (cases, size) = weigh(series);
        let log = prior.ln() + cases.log_likelihood();
        (hypothesis, cases.likeliest(), size, log)
    };
    let is_left_out = |hypothesis: &&Hypothesis<Series>| {
        without.is_some_and(|kind| hypothesis.kind == kind.into())
    };
    let mut weighed: Vec<_> =
        hypotheses.iter().filter(|one| !is_left_out(one)).map(weigh).collect();
    weighed.retain(|(.., log)| !log.is_nan());
    if is_early {
        let mut known = Mixture::default();
        let is_known = |hypothesis: &Hypothesis<Series>| hypothesis.kind.known().is_some();
        for (hypothesis, .., log) in &weighed {
            if is_known(hypothesis) {
                known.add(Weighed::of(*log));
            }
        }
        let most = known.log_likelihood();
        for (hypothesis, .., log) in &mut weighed {
            if !is_known(hypothesis) {
                *log = log.min(most);
            }
        }
    }
    weighed.sort_by(|(.., a), (.., b)| b.total_cmp(a));
    let Some(&(.., largest)) = weighed.first().filter(|(.., log)| log.is_finite()) else {
        return (Vec::new(), Vec::new());
    };
    let all: f64 = weighed.iter().map(|(.., log)| (log - largest).exp()).sum();
    weighed.retain(|(hypothesis, _, size, _)| !may_be_healthy(hypothesis.kind, size.as_ref()));
    let best = weighed.first().map(|(hypothesis, best, ..)| (hypothesis, best));
    let candidates = weighed.iter().map(|(hypothesis, _, size, log)| {
        let probability = (log - largest).exp() / all;
        Candidate { kind: hypothesis.kind, probability, size: *size }
    });
    let mentioned = candidates.filter(|candidate| candidate.probability >= MENTIONED).collect();
    let shown = best.and_then(|(hypothesis, best)| Some((hypothesis.show)(series, best.as_ref()?)));
    (mentioned, shown.unwrap_or_default())
}

/// Whether the interval of a size holds that of a component without a fault.
pub(crate) fn may_be_healthy(kind: IdentifiedKind, size: Option<&FaultSize>) -> bool {
    let healthy = if kind.known() == Some(FaultKind::Gain) { 1.0 } else { 0.0 };
    size.is_some_and(|size| (size.low..=size.high).contains(&healthy))
}
