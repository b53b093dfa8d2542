//! The read model: what monitoring clients observe and which commands they may send, without a network or a runtime.
//!
//! `session::client` brings the messages, and sends the questions and commands.
//!
//! | file | what |
//! |---|---|
//! | `view` | the read model: what every view shows, as plain values |
//! | `feed` | verdicts, kinds of faults, phases and presence, each once and in order; asks for missed transitions |
//! | `trend` | how margins develop: summaries in a fixed space, forecasts |
//! | `calls` | what people have to be told of incidents, and who has been told |
//! | `certificate` | certificates that expire soon |
//! | `testing` | made-up messages and views, for tests |

pub mod calls;
mod certificate;
pub mod feed;
pub mod testing;
pub mod trend;
mod view;

pub use certificate::ShownCertificate;
pub use view::{
    Belonging, ComponentId, Contradiction, CountedLine, Counts, DetectionFacts, EventLine,
    HistoryGap, JournalEntry, JournalHealth, Journals, ModuleHistory, ModuleId, ModuleView,
    NetworkState, News, ObservedEvent, OrderOutcome, OrderRequest, PastFault, PeriodReport,
    QueryError, RowGroup, RowId, Scene, StateRow, StructureRow, Structures, Times, Urgency, alarms,
    all_is_well, attention, counted, explained_by, in_a_sentence, is_frame_of,
    known_identification, order_subject, rows, scene_at, sign, structures, title, why_no_fault,
};
