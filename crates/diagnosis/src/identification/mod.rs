//! What kind of fault it is, and how large: fault identification, after detection and isolation.
//!
//! The series around the onset ([`Excerpt`]) is weighed under every kind that the component can have: a gage by how much
//! more it reads than the other gages and the forces say, a cylinder by both chambers' balance of oil. Each hypothesis has
//! a file of its own with what it does to the series, how likely it is beforehand and how large it may be; what it leaves
//! open (onset, size) is integrated out, so that a hypothesis that fits anything gains nothing by that (marginal
//! likelihood). From the likelihoods and the priors follow the probabilities of the kinds.

mod axis;
mod candidate;
mod cylinder;
mod excerpt;
mod gage;
mod hypothesis;
mod level;
mod mixture;
mod points;
mod signature;
mod wandering;

#[cfg(test)]
mod any_series;

use vocabulary::{Component, RunId, Step, fault::FaultKind};

pub use candidate::Candidate;
pub use excerpt::Excerpt;
pub(crate) use excerpt::{
    CylinderSeries, CylinderStep, GageSecond, GageSeries, GageStep, Measured, Seen,
};
use hypothesis::{Hypothesis, Weighing};
pub(crate) use level::Prior;
pub use mixture::Size;
pub use signature::SignaturePoint;

/// A kind is decided when it is at least so probable.
pub const DECIDED: f64 = 0.95;
/// Kinds below this are not mentioned.
const MENTIONED: f64 = 0.01;

/// What kind of fault it may be, and how large, as of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Identification {
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

impl Identification {
    /// The kind, if it is decided.
    #[must_use]
    pub fn decided(&self) -> Option<&Candidate> {
        self.candidates.first().filter(|first| first.probability >= DECIDED)
    }
}

/// Identifies a fault.
#[must_use]
pub fn identify(excerpt: &Excerpt) -> Identification {
    let (candidates, signature) = match &excerpt.measured {
        Measured::Gage(series) => gage::record::Record::new(excerpt, series)
            .map(|record| weigh(&record, &gage::HYPOTHESES)),
        Measured::Cylinder(series) => cylinder::record::Record::new(excerpt, series)
            .map(|record| weigh(&record, &cylinder::HYPOTHESES)),
        Measured::Nothing => {
            let certain = Candidate { kind: FaultKind::NoSignal, probability: 1.0, size: None };
            Some((vec![certain], Vec::new()))
        }
    }
    .unwrap_or_default();
    Identification {
        run: excerpt.run,
        sequence: excerpt.sequence,
        component: excerpt.component.clone(),
        as_of: excerpt.as_of,
        candidates,
        signature,
    }
}

/// The probabilities of kinds by Bayes' rule, the most probable first, and what was measured beside what that one makes of
/// it.
fn weigh<Series>(
    series: &Series,
    hypotheses: &[Hypothesis<Series>],
) -> (Vec<Candidate>, Vec<SignaturePoint>) {
    let mut weighed: Vec<(&Hypothesis<Series>, Weighing, f64)> = hypotheses
        .iter()
        .map(|hypothesis| {
            let weighing = (hypothesis.weigh)(series);
            let log = hypothesis.prior.ln() + weighing.log_likelihood;
            (hypothesis, weighing, log)
        })
        .collect();
    weighed.retain(|(_, _, log)| !log.is_nan());
    weighed.sort_by(|(_, _, a), (_, _, b)| b.total_cmp(a));
    let Some((likeliest, weighing, largest)) =
        weighed.first().filter(|(_, _, log)| log.is_finite())
    else {
        return (Vec::new(), Vec::new());
    };
    let all: f64 = weighed.iter().map(|(_, _, log)| (log - largest).exp()).sum();
    let candidate =
        |(hypothesis, weighing, log): &(&Hypothesis<Series>, Weighing, f64)| Candidate {
            kind: hypothesis.kind,
            probability: (log - largest).exp() / all,
            size: weighing.size,
        };
    let candidates = weighed.iter().map(candidate);
    let mentioned = candidates.filter(|candidate| candidate.probability >= MENTIONED).collect();
    let shown = weighing.likeliest.map(|best| (likeliest.show)(series, &best));
    (mentioned, shown.unwrap_or_default())
}
