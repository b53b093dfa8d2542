//! What everyone needs who looks on from outside: the operator's commands, the terminal, the demo, tests.
//!
//! | file | what |
//! |---|---|
//! | `asking` | one question to one process: answered, refused or unanswered |
//! | `presence` | who is there, and of which structure |
//! | `roll_call` | every module there is or should be, with its latest status and phase |
//! | `picture` | the same with the present state of every component |
//! | `history` | a module's journal |
//! | `feed` | verdicts, phases and presence, as they are told |
//! | `diagnoser_orders` | acknowledge and reset |
//! | `plant_orders` | faults for the simulated plant |

mod asking;
mod diagnoser_orders;
mod feed;
mod history;
mod picture;
mod plant_orders;
mod presence;
mod roll_call;

pub use asking::{OrderError, QueryError};
pub use diagnoser_orders::order;
pub use feed::{Feed, News};
pub use history::{Gap, ModuleHistory, history};
pub use picture::{ModulePicture, Picture, present};
pub use plant_orders::inject;
pub use presence::{AttendanceError, homes, plants, wait_for};
pub use roll_call::{Member, RollCall, roll_call};
