//! The read model: what every view shows, as plain values. Neither a network nor a runtime is named here.
//!
//! | file | what |
//! |---|---|
//! | `news` | what happens |
//! | `structures` | what is known: news, statuses, states and the time go in |
//! | `scene` | and come out as this: modules, components, the latest events |
//! | `component`, `module` | a component and a module as every view shows them |
//! | `id` | which component or module it is |
//! | `row`, `alarms` | what is urgent, and whether all is well |
//! | `line` | an event, or an entry of a journal, as a line |
//! | `journal` | what modules' journals hold, merged, and what is missing from them |
//! | `order` | a command, and how it ended |

mod alarms;
mod component;
mod id;
mod journal;
mod line;
mod module;
mod news;
mod order;
mod row;
mod scene;
mod structures;
#[cfg(test)]
mod tests;

pub(crate) use component::is_frame_of;

pub use alarms::{StructureRow, alarms, all_is_well, rows, structures};
pub use component::{Counts, explained_by, identification as known_identification, title};
pub use id::{ComponentId, ModuleId, RowId};
pub use journal::{Contradiction, HistoryGap, JournalEntry, Journals, ModuleHistory};
pub use line::{EventLine, sign};
pub use module::{JournalHealth, ModuleView};
pub use news::{News, ObservedEvent};
pub use order::{OrderOutcome, OrderRequest, QueryError};
pub use row::{DetectionFacts, StateRow, Urgency};
pub use scene::{NetworkState, Scene};
pub use structures::Structures;
