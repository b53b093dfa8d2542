//! Everything that goes out: handed in without waiting, carried by two threads.

mod audience;
mod event_lane;
mod identified_faults;
mod outbox;
mod routine_lane;
mod states;

pub(crate) use event_lane::{Books, EventLane, Outgoing};
pub(crate) use identified_faults::IdentifiedFaults;
pub(crate) use outbox::{Drained, Outbox};
pub(crate) use routine_lane::{Routine, RoutineLane};
pub(crate) use states::States;
