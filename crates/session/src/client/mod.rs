//! What monitoring clients do over a session: observe structures, ask modules, send commands.
//!
//! | file | what |
//! |---|---|
//! | `live` | keeps the read model (`observer`) up to date |
//! | `feed_queries` | asks modules what the feed of events missed |
//! | `request` | one question to one process: answered, refused or unanswered |
//! | `presence` | which processes are running, and in which structure |
//! | `divergences` | subscribes to a module's divergences |
//! | `module_queries` | a module's journal, the kind of a component's fault, freeze frames |
//! | `orders` | commands: acknowledge, reset, shelve, suppress; faults and stroke tests for the simulated plant |

mod divergences;
mod feed_queries;
mod live;
mod module_queries;
mod orders;
mod presence;
mod request;

pub use divergences::DivergenceFeed;
pub use live::{Live, attendance, present};
pub use module_queries::{freeze_frame, freeze_frame_of, freeze_frames, history, identification};
pub use orders::{inject, order, stroke};
pub use presence::{AttendanceError, homes, plants, wait_for};
