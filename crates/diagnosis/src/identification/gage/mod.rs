//! What can be wrong with a gage: one hypothesis a file.

mod bias;
mod drift;
mod gain;
mod intermittent;
mod random_walk;
pub(super) mod record;
mod scales;
mod stuck;
mod zero_output;

use super::hypothesis::Hypothesis;
use record::Record;

/// All of them.
pub(super) const HYPOTHESES: [Hypothesis<Record>; 7] = [
    bias::HYPOTHESIS,
    drift::HYPOTHESIS,
    gain::HYPOTHESIS,
    intermittent::HYPOTHESIS,
    zero_output::HYPOTHESIS,
    stuck::HYPOTHESIS,
    random_walk::HYPOTHESIS,
];
