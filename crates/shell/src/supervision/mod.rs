//! The service manager's view of a process: readiness, status, progress.
//!
//! | file | job |
//! |---|---|
//! | `supervisor` | ready, progress, status, stopping: what is sent when |
//! | `notification` | a datagram to the service manager, without ever waiting for it |
//! | `pulse` | the same progress for `health`, and that of the threads beside the loop |
//! | `crew` | threads and tasks that a process cannot do without |
//! | `scheduling` | how the kernel treats the process: policy, priority, limits |
//!
//! Only the thread or task that does the work reports progress, from its own loop. If it or a thread beside it hangs,
//! no heartbeat is sent, and the service manager restarts the process; if one ends, the process ends.

mod crew;
mod notification;
mod pulse;
pub(crate) mod scheduling;
mod supervisor;

pub use crew::{Crew, Ended};
pub use pulse::{Lane, Pulse, Sign};
pub use supervisor::Supervisor;

/// The status before there is a session.
pub const OPENING: &str = "opening a session";
/// The status when the loop is over.
pub const STOPPING: &str = "stopping";
