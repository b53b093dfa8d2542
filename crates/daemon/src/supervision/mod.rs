//! The service manager's view of a process: whether it is ready, how it is, whether it makes progress.
//!
//! | file | job |
//! |---|---|
//! | `supervisor` | ready, progress, status, stopping: what is told when |
//! | `notification` | a datagram to the service manager, without ever waiting for it |
//! | `pulse` | the same progress for whoever asks, see `health` |
//! | `words` | the one-line status that `systemctl status` shows |
//! | `scheduling` | how the kernel treats the process: policy, priority, limits |
//!
//! Only the thread or task that does the work tells of progress, by coming round its own loop. If it
//! hangs, nothing tells in its stead, and the service manager starts the process anew.

mod notification;
mod pulse;
pub(crate) mod scheduling;
mod supervisor;
pub(crate) mod words;

pub(crate) use pulse::{Pulse, Sign};
pub(crate) use supervisor::Supervisor;
