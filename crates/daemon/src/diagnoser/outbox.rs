//! Takes what is to go out; never waits. Two threads carry it: `event_lane` what must not be lost,
//! `routine_lane` the rest.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};

use tokio::sync::{mpsc, oneshot};
use wire::PublisherCounters;

use super::event_lane::{Event, EventLane};
use super::routine_lane::{Audiences, Routine, RoutineLane};
use crate::occurrences::worth_a_line;

const QUEUE: usize = 8192;
/// Room that refusals leave to answers and status: whoever asks nonsense crowds nobody out.
const KEPT_FREE: usize = QUEUE - 1024;

#[derive(Debug, Default)]
struct Counters {
    events: AtomicU64,
    events_lost: AtomicU64,
    replies_lost: AtomicU64,
}

/// The way out.
#[derive(Debug, Clone)]
pub(crate) struct Outbox {
    events: SyncSender<Event>,
    routine: mpsc::Sender<Routine>,
    /// Who hears of what is said often; it need not be handed in if nobody does.
    pub(crate) audiences: Audiences,
    counters: Arc<Counters>,
}

/// Tells when both threads have carried everything.
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
        Ok((Self { events, routine, audiences, counters: Arc::default() }, drained))
    }

    /// Something that must not be lost. If there is no room, the network has taken nothing for very
    /// long; then it is, and that is counted. Whether there was room.
    pub(crate) fn event(&self, event: Event) -> bool {
        let told = matches!(event, Event::Fault(_) | Event::Change(_) | Event::Phase(_));
        self.counters.events.fetch_add(u64::from(told), Ordering::Relaxed);
        let taken = self.events.try_send(event).is_ok();
        if !taken && told {
            let lost = self.counters.events_lost.fetch_add(1, Ordering::Relaxed) + 1;
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
            self.counters.replies_lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    pub(crate) fn counters(&self) -> PublisherCounters {
        let read = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        PublisherCounters {
            events: read(&self.counters.events),
            events_lost: read(&self.counters.events_lost),
            replies_lost: read(&self.counters.replies_lost),
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
        // Nobody listens any more if the process is in a hurry.
        let _ = ending.send(());
    })?;
    Ok(ended)
}
