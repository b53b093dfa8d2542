//! A kind of fault as a hypothesis: what it does to a series, how likely it is beforehand, and how large it may be.

use vocabulary::fault::FaultKind;

use super::level::Weighed;
use super::mixture::{Mixture, Size};
use super::signature::SignaturePoint;

/// A hypothesis about series of this type.
pub(super) struct Hypothesis<Series> {
    /// The kind.
    pub(super) kind: FaultKind,
    /// How likely it is beforehand, in comparison with the others of its component.
    pub(super) prior: f64,
    /// Its likelihood and its size.
    pub(super) weigh: fn(&Series) -> Weighing,
    /// What its likeliest case makes of what was measured.
    pub(super) show: fn(&Series, &Weighed) -> Vec<SignaturePoint>,
}

/// What a series says under a hypothesis.
#[derive(Debug, Clone)]
pub(super) struct Weighing {
    /// Logarithm of its marginal likelihood.
    pub(super) log_likelihood: f64,
    /// Its size, if it has one.
    pub(super) size: Option<Size>,
    /// Its likeliest case.
    pub(super) likeliest: Option<Weighed>,
}

impl Weighing {
    /// Of a hypothesis whose size is the coefficient, which may be wrong by so much more than noise makes it, as a standard
    /// deviation that may depend on the size.
    pub(super) fn sized(cases: &Mixture, error: impl Fn(f64) -> f64) -> Self {
        let size = cases.size().map(|size| size.with_error(error(size.value)));
        Self { size, ..Self::without_size(cases) }
    }

    /// Of a hypothesis that has no size.
    pub(super) fn without_size(cases: &Mixture) -> Self {
        let likeliest = cases.likeliest();
        Self { log_likelihood: cases.log_likelihood(), size: None, likeliest }
    }
}
