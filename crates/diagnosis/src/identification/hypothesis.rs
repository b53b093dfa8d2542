//! A kind of fault as a hypothesis: what it does to a series, how likely it is beforehand, and how large it may be.

use names::fault::FaultKind;

use super::mixture::{Mixture, Size};

/// A hypothesis about series of this type.
pub(super) struct Hypothesis<Series> {
    /// The kind.
    pub(super) kind: FaultKind,
    /// How likely it is beforehand, in comparison with the others of its component.
    pub(super) prior: f64,
    /// Its likelihood and its size.
    pub(super) weigh: fn(&Series) -> Weighing,
}

/// What a series says under a hypothesis.
#[derive(Debug, Clone)]
pub(super) struct Weighing {
    /// Logarithm of its marginal likelihood.
    pub(super) log_likelihood: f64,
    /// Its size, if it has one.
    pub(super) size: Option<Size>,
}

impl Weighing {
    /// Of a hypothesis whose size is the coefficient.
    pub(super) fn sized(cases: &Mixture) -> Self {
        Self { log_likelihood: cases.log_likelihood(), size: cases.size() }
    }

    /// Of a hypothesis that has no size.
    pub(super) fn without_size(cases: &Mixture) -> Self {
        Self { log_likelihood: cases.log_likelihood(), size: None }
    }
}
