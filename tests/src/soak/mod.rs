//! A plant and its diagnosers for hours of the plant's time: what must not grow, drift or stop.
//!
//! | file | job |
//! |---|---|
//! | `memory` | a process's resident memory from beginning to end |
//! | `heartbeat` | a module's status messages: their regularity and contents |
//! | `stalls` | how long the machine kept the test itself waiting |

mod heartbeat;
mod memory;
mod stalls;

pub use heartbeat::{Heartbeat, Heartbeats};
pub use memory::Memory;
pub use stalls::Stalls;
