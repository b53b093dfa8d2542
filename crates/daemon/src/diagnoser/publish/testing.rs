//! An outbox whose messages stay in their queues.

use std::sync::mpsc::Receiver;

use diagnosis::messages::Speaker;

use super::*;

pub(crate) fn speaker() -> Speaker {
    Speaker::of("tower".parse().unwrap(), "module1".parse().unwrap())
}

/// With room for so many events.
pub(crate) fn outbox(store: ModuleStore, room: usize) -> (ModuleOutbox, Receiver<WaitingEvent>) {
    let (events, events_out) = sync_channel(room);
    let (routine, _) = mpsc::channel(1);
    let audiences = Audiences {
        divergences: Audience::default(),
        corrected: Audience::default(),
        progress: Audience::default(),
    };
    (ModuleOutbox::new(store, events, routine, audiences), events_out)
}
