//! Process supervision by the service manager: readiness, status, progress.
//!
//! | file | job |
//! |---|---|
//! | `supervisor` | when to send readiness, progress, status and stopping |
//! | `notification` | sends a datagram to the service manager without blocking |
//! | `pulse` | progress of the loop and of other threads, also for `health` |
//! | `crew` | essential threads and tasks |
//! | `scheduling` | logs policy, priority and limits set by the kernel |
//!
//! Only the thread or task that does the work reports progress, from its own loop. If it or an essential thread hangs,
//! no heartbeat is sent, and the service manager restarts the process; if one ends, the process ends.

mod crew;
mod notification;
mod pulse;
pub(crate) mod scheduling;
mod supervisor;

pub use crew::{Crew, Ended};
pub use pulse::{Lane, Pulse, Sign};
pub use supervisor::Supervisor;

/// The status while the session is being opened.
pub const OPENING: &str = "opening a session";
/// The status after the loop has ended.
pub const STOPPING: &str = "stopping";
