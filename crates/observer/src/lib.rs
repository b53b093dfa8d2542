//! What monitoring clients see, and what they may command.
//!
//! | file | what |
//! |---|---|
//! | `view` | the read model: what every view shows, as plain values |
//! | `live` | keeps it up to date over a session |
//! | `feed` | verdicts, kinds of faults, phases and presence, as they are published, with what was missed |
//! | `request` | one question to one process: answered, refused or unanswered |
//! | `presence` | which processes are there, and of which structure |
//! | `divergences` | a module's divergences as they are published |
//! | `history` | a module's journal |
//! | `identification` | what kind of fault a component has, with what was measured of it |
//! | `freeze_frame` | what a module saw around the latching of its latest faults |
//! | `diagnoser_orders` | acknowledge, reset, shelve and suppress |
//! | `plant_orders` | faults and stroke tests for the simulated plant |
//! | `testing` | made-up messages and views, for tests |

mod diagnoser_orders;
mod divergences;
mod feed;
mod freeze_frame;
mod history;
mod identification;
mod live;
mod plant_orders;
mod presence;
mod request;
pub mod testing;
mod view;

pub use diagnoser_orders::{Command, order};
pub use divergences::DivergenceFeed;
pub use freeze_frame::{freeze_frame, freeze_frame_of, freeze_frames};
pub use history::history;
pub use identification::identification;
pub use live::{Live, attendance, present};
pub use plant_orders::{inject, stroke};
pub use presence::{AttendanceError, homes, plants, wait_for};
pub use view::{
    Contradiction, Counts, Entry, Event, EventLine, Gap, JournalHealth, Journals, Measured,
    ModuleHistory, ModuleView, NetworkState, News, OrderError, OrderOutcome, QueryError, Scene,
    StateRow, StructureRow, Structures, Urgency, alarms, all_is_well, explained_by,
    known_identification, rows, sign, structures, title,
};
