//! References of healthy modules: what they measure under changing weather and while their cylinders move.

mod collector;
mod learn;
mod runs;
mod site;

pub use collector::{SETTLING_S, WindowCollector};
pub use learn::{FALSE_ALARMS_PER_HOUR, learn};
pub use runs::{SnippetPlan, record_snippets, usual_snippets};
pub use site::Site;
