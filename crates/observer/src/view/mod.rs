//! The read model: everything that views show, as plain values, independent of the network and the async runtime.
//!
//! | file | what |
//! |---|---|
//! | `news` | events |
//! | `structures` | builds the model from news, statuses, states and the time |
//! | `scene` | the model at one moment: modules, components, the latest events |
//! | `component`, `module` | a component and a module as every view shows them |
//! | `id` | identifies a component or a module |
//! | `row`, `alarms` | ranks alarms, brings together what belongs to one incident, and decides whether all is well |
//! | `line` | an event, or an entry of a journal, on one line |
//! | `journal` | merged journals with their gaps |
//! | `report` | a period: availability, faults, times to acknowledge, gaps |
//! | `order` | a command and its outcome |

mod alarms;
mod component;
mod id;
mod journal;
mod line;
mod module;
mod news;
mod order;
mod report;
mod row;
mod scene;
mod structures;
#[cfg(test)]
mod tests;

pub use alarms::{StructureRow, alarms, all_is_well, attention, rows, structures};
pub use component::{
    Counts, explained_by, identification as known_identification, is_frame_of, title, why_no_fault,
};
pub use id::{ComponentId, ModuleId, RowId};
pub use journal::{Contradiction, HistoryGap, JournalEntry, Journals, ModuleHistory};
pub use line::{CountedLine, EventLine, counted, sign};
pub use module::{JournalHealth, ModuleView};
pub use news::{News, ObservedEvent};
pub use order::{OrderOutcome, OrderRequest, QueryError, order_subject};
pub use report::{PastFault, PeriodReport, Times, scene_at};
pub use row::{Belonging, DetectionFacts, RowGroup, StateRow, Urgency};
pub use scene::{NetworkState, Scene, in_a_sentence};
pub use structures::Structures;
