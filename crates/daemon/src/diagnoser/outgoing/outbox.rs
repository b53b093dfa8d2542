//! Takes what is to go out; never waits. Two threads carry it: `event_lane` what must not be lost,
//! `routine_lane` the rest.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};

use shell::occurrences::worth_a_line;
use tokio::sync::{mpsc, oneshot};
use wire::PublisherCounters;

use super::event_lane::{EventLane, Outgoing};
use super::routine_lane::{Audiences, Routine, RoutineLane};

const QUEUE: usize = 8192;
/// Room that refusals leave to answers and status: malformed queries crowd nothing out.
const KEPT_FREE: usize = QUEUE - 1024;

#[derive(Debug, Default)]
struct OutboxTally {
    events: AtomicU64,
    events_lost: AtomicU64,
    replies_lost: AtomicU64,
}

/// The way out.
#[derive(Debug, Clone)]
pub(crate) struct Outbox {
    events: SyncSender<Outgoing>,
    routine: mpsc::Sender<Routine>,
    /// The subscribers of frequent messages; without any, these need not be handed in.
    pub(crate) audiences: Audiences,
    tally: Arc<OutboxTally>,
}

/// Signals that both threads have carried everything.
pub(crate) type Drained = [oneshot::Receiver<()>; 2];

impl Outbox {
    /// Starts the threads, which end when all outboxes are gone.
    pub(crate) fn open(
        events: EventLane,
        routine: RoutineLane,
    ) -> std::io::Result<(Self, Drained)> {
        let (events_in, events_out) = sync_channel(QUEUE);
        let (routine_in, routine_out) = mpsc::channel(QUEUE);
        let audiences = routine.audiences();
        let drained = [
            thread("events", move || events.run(&events_out))?,
            thread("routine", move || routine.run(routine_out))?,
        ];
        let (events, routine) = (events_in, routine_in);
        Ok((Self { events, routine, audiences, tally: Arc::default() }, drained))
    }

    /// Something that must not be lost. If there is no room, the network has taken nothing for very
    /// long; then it is, and that is counted. Whether there was room.
    pub(crate) fn event(&self, event: Outgoing) -> bool {
        let counted =
            matches!(event, Outgoing::Fault(_) | Outgoing::Change(_) | Outgoing::Phase(_));
        self.tally.events.fetch_add(u64::from(counted), Ordering::Relaxed);
        let taken = self.events.try_send(event).is_ok();
        if !taken && counted {
            let lost = self.tally.events_lost.fetch_add(1, Ordering::Relaxed) + 1;
            if worth_a_line(lost) {
                tracing::error!(times = lost, "event lost: the network takes nothing");
            }
        }
        taken
    }

    /// Something that is dropped if there is no room; a reply is counted then.
    pub(crate) fn routine(&self, message: Routine) {
        let (reply, room) = match message {
            Routine::Refusal { .. } => (true, self.routine.capacity() > KEPT_FREE),
            Routine::Answer { .. } => (true, true),
            _ => (false, true),
        };
        let taken = room && self.routine.try_send(message).is_ok();
        if reply && !taken {
            self.tally.replies_lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    pub(crate) fn counters(&self) -> PublisherCounters {
        let read = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        PublisherCounters {
            events: read(&self.tally.events),
            events_lost: read(&self.tally.events_lost),
            replies_lost: read(&self.tally.replies_lost),
        }
    }
}

fn thread(
    name: &str,
    work: impl FnOnce() + Send + 'static,
) -> std::io::Result<oneshot::Receiver<()>> {
    let (ending, ended) = oneshot::channel();
    std::thread::Builder::new().name(name.to_owned()).spawn(move || {
        work();
        // The receiver is gone if the process ends in a hurry.
        let _ = ending.send(());
    })?;
    Ok(ended)
}
