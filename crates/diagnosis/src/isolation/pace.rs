//! How soon peers are asked again.

use crate::settings::Sampling;

/// Time after which an unanswered question is put again, or a peer asked whether it stands by its word \[s\].
const FIRST_S: f64 = 0.25;
/// An unanswered question is put again after twice as long at every failure, up to this \[s\].
const LONGEST_S: f64 = 1.0;

/// The same in steps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    pub(super) first: u64,
    pub(super) longest: u64,
}

impl Pace {
    pub(super) fn new(sampling: Sampling) -> Self {
        Self { first: sampling.steps(FIRST_S), longest: sampling.steps(LONGEST_S) }
    }
}
