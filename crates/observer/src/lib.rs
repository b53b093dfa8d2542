//! What monitoring clients share: the operator's commands, the terminal, the demo, tests.
//!
//! | file | what |
//! |---|---|
//! | `request` | one question to one process: answered, refused or unanswered |
//! | `presence` | who is there, and of which structure |
//! | `attendance` | every module there is or should be, with its latest status and phase |
//! | `picture` | the same with the present state of every component |
//! | `live` | that picture as it is at every moment, with the latest events |
//! | `divergences` | a module's divergences as they are published |
//! | `urgency` | which component needs attention first |
//! | `history` | a module's journal |
//! | `feed` | verdicts, kinds of faults, phases and presence, as they are published, with what was missed |
//! | `identification` | what kind of fault a component has, with what was measured of it |
//! | `freeze_frame` | what a module saw around the latching of its latest faults |
//! | `diagnoser_orders` | acknowledge, reset, shelve and suppress |
//! | `plant_orders` | faults and stroke tests for the simulated plant |

mod attendance;
mod diagnoser_orders;
mod divergences;
mod feed;
mod freeze_frame;
mod history;
mod identification;
mod live;
mod picture;
mod plant_orders;
mod presence;
mod request;
#[cfg(test)]
mod testing;
mod urgency;

pub use attendance::{Attendance, Member, attendance};
pub use diagnoser_orders::{Command, order};
pub use divergences::DivergenceFeed;
pub use feed::{Feed, News};
pub use freeze_frame::{freeze_frame, freeze_frame_of, freeze_frames};
pub use history::{Gap, ModuleHistory, history};
pub use identification::identification;
pub use live::{Event, Live, LiveModule, NetworkState, Scene};
pub use picture::{ModulePicture, Picture, UnreadableState, present};
pub use plant_orders::{inject, stroke};
pub use presence::{AttendanceError, homes, plants, wait_for};
pub use request::{OrderError, QueryError};
pub use urgency::Urgency;
