//! The service manager's view of a process: readiness, status, progress.
//!
//! | file | job |
//! |---|---|
//! | `supervisor` | ready, progress, status, stopping: what is sent when |
//! | `notification` | a datagram to the service manager, without ever waiting for it |
//! | `pulse` | the same progress for `health` |
//! | `scheduling` | how the kernel treats the process: policy, priority, limits |
//!
//! Only the thread or task that does the work reports progress, from its own loop. If it hangs, no
//! heartbeat is sent, and the service manager restarts the process.

mod notification;
mod pulse;
pub(crate) mod scheduling;
mod supervisor;

pub use pulse::{Pulse, Sign};
pub use supervisor::Supervisor;

/// The status before there is a session.
pub const OPENING: &str = "opening a session";
/// The status when the loop is over.
pub const STOPPING: &str = "stopping";
