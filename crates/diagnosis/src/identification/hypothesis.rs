//! A kind of fault as a hypothesis: what it does to a series, how likely it is beforehand, and how large it may be.

use names::fault::FaultKind;

use super::mixture::Mixture;

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
    /// Onsets, and scales of its size.
    pub(super) cases: Mixture,
    /// Does its size mean anything?
    pub(super) has_size: bool,
}
