//! What kind of fault it is, and how large: is the diagnosers' word right, and how soon?

mod draw;
mod run;
mod tally;

pub use draw::{IdentificationCase, IdentificationCases, IdentificationSituation};
pub use run::{IdentificationRecord, Word, run_case};
pub use tally::{
    IdentificationTally, KindRow, SIZES_IN_LIMITS, SituationRow, Sizing, UNDECIDED_AFTER_S,
    UndecidedBySize,
};
