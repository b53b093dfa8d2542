//! What is done to a deployment, each kind in a file of its own.
//!
//! | file | what |
//! |---|---|
//! | `crash` | processes are killed and restarted, in any order |
//! | `panic` | a thread panics |
//! | `broken_disk` | a disk hangs or is full |
//! | `freeze` | a process is suspended |
//! | `bad_network` | loss, delay, reordering, partitions |
//! | `lying_peer` | an impostor replies in a module's name |
//! | `lost_router` | one of two linked routers is killed and comes back |
//! | `flood` | an unknown publisher sends samples |
//! | `large_messages` | a stranger sends messages that are too long |
//! | `clock_jump` | the publisher's clock jumps |

mod bad_network;
mod broken_disk;
mod clock_jump;
mod crash;
mod flood;
mod freeze;
mod large_messages;
mod lost_router;
mod lying_peer;
mod panic;

use std::future::Future;
use std::pin::Pin;

pub use bad_network::BadNetwork;
pub use broken_disk::BrokenDisk;
pub use clock_jump::ClockJump;
pub use crash::Crash;
pub use flood::Flood;
pub use freeze::Freeze;
pub use large_messages::LargeMessages;
pub use lost_router::LostRouter;
pub use lying_peer::{Lie, LyingPeer};
pub use panic::Panic;

use super::stage::{Site, Stage};

/// Something that is under way.
pub type Deed<'a> = Pin<Box<dyn Future<Output = ()> + Send + 'a>>;

/// Something that happens to a deployment, with a beginning and an end.
pub trait Disturbance: Send {
    /// What must be there before the processes start.
    fn set_up<'a>(&'a mut self, _site: &'a mut Site) -> Deed<'a> {
        Box::pin(async {})
    }

    /// The beginning.
    fn begin<'a>(&'a mut self, stage: &'a mut Stage) -> Deed<'a>;

    /// The end.
    fn end<'a>(&'a mut self, stage: &'a mut Stage) -> Deed<'a>;

    /// After the last step.
    fn tear_down(&mut self) -> Deed<'_> {
        Box::pin(async {})
    }

    /// Its measured effect.
    ///
    /// # Errors
    /// It had no effect, so the row proves nothing.
    fn effect(&self) -> Result<String, String> {
        Ok(String::new())
    }
}

/// Nothing happens.
pub struct Nothing;

impl Disturbance for Nothing {
    fn begin<'a>(&'a mut self, _stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(async {})
    }

    fn end<'a>(&'a mut self, _stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(async {})
    }
}
