//! The client side of monitoring: what clients observe and which commands they may send.
//!
//! | file | what |
//! |---|---|
//! | `view` | the read model: what every view shows, as plain values |
//! | `live` | keeps the read model up to date over a session |
//! | `feed` | verdicts, kinds of faults, phases and presence, each once and in order; fetches missed transitions |
//! | `request` | one question to one process: answered, refused or unanswered |
//! | `presence` | which processes are running, and in which structure |
//! | `divergences` | subscribes to a module's divergences |
//! | `module_queries` | a module's journal, the kind of a component's fault, freeze frames |
//! | `orders` | commands: acknowledge, reset, shelve, suppress; faults and stroke tests for the simulated plant |
//! | `testing` | made-up messages and views, for tests |

mod divergences;
mod feed;
mod live;
mod module_queries;
mod orders;
mod presence;
mod request;
pub mod testing;
mod view;

pub use divergences::DivergenceFeed;
pub use live::{Live, attendance, present};
pub use module_queries::{freeze_frame, freeze_frame_of, freeze_frames, history, identification};
pub use orders::{inject, order, stroke};
pub use presence::{AttendanceError, homes, plants, wait_for};
pub use view::{
    ComponentId, Contradiction, Counts, DetectionFacts, EventLine, HistoryGap, JournalEntry,
    JournalHealth, Journals, ModuleHistory, ModuleId, ModuleView, NetworkState, News,
    ObservedEvent, OrderOutcome, OrderRequest, QueryError, RowId, Scene, StateRow, StructureRow,
    Structures, Urgency, alarms, all_is_well, attention, explained_by, in_a_sentence,
    known_identification, order_subject, rows, sign, structures, title, why_no_fault,
};
