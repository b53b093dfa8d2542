//! What can be wrong with a cylinder: one hypothesis a file.

mod external_leakage;
mod flows;
mod hard_over;
mod internal_leakage;
pub(super) mod record;
mod stiction;

use super::hypothesis::Hypothesis;
use record::Record;

/// All of them.
pub(super) const HYPOTHESES: [Hypothesis<Record>; 5] = [
    internal_leakage::HYPOTHESIS,
    external_leakage::OF_A,
    external_leakage::OF_B,
    hard_over::HYPOTHESIS,
    stiction::HYPOTHESIS,
];
