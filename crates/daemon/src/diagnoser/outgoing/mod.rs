//! Everything that goes out: handed in without waiting, carried by threads.
//!
//! | file | job |
//! |---|---|
//! | `outbox` | takes what is to go out, into the journal and a queue; never waits |
//! | `event_lane` | what must not be lost onto the network, once the disk has it |
//! | `routine_lane` | what is superseded soon, answers to peers |
//! | `reply_lane` | replies to those who ask what is known at present |
//! | `books` | what is known at present: `states` of components, `identified_faults`, the phase |
//! | `audience` | whether anybody subscribes |

mod audience;
mod books;
mod event_lane;
mod identified_faults;
mod outbox;
mod reply_lane;
mod routine_lane;
mod states;

pub(crate) use books::{Books, SharedBooks};
pub(crate) use event_lane::{EventLane, Outgoing};
pub(crate) use identified_faults::IdentifiedFaults;
#[cfg(test)]
pub(crate) use outbox::testing;
pub(crate) use outbox::{Drained, Lanes, Outbox};
pub(crate) use reply_lane::{Asked, ReplyLane, Wanted};
pub(crate) use routine_lane::{Routine, RoutineLane};
pub(crate) use states::States;
