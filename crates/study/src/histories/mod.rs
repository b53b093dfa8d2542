//! Random histories: faults that come, go, come again and overlap, lost samples and restarts. Whatever happens,
//! nothing healthy may be named.
//!
//! | file | concept |
//! |---|---|
//! | `draw` | what happens in a history |
//! | `pattern` | how its faults follow each other |
//! | `run` | plant and diagnosers go through it |
//! | `record` | what came of it |
//! | `tally` | what came of many |

mod draw;
mod pattern;
mod record;
mod run;
mod tally;

pub use draw::{Disturbance, History};
pub use pattern::Pattern;
pub use record::{HistoryRecord, Named};
pub use run::run_history;
pub use tally::HistoryTally;
