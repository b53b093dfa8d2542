//! Everything that goes out: handed in without waiting, published by threads. What is to be kept goes to the store at once,
//! whatever the network does.
//!
//! | file | publishes |
//! |---|---|
//! | `events` | what must not be lost, once the disk has it: transitions, identifications, changes, phases, inputs |
//! | `routine` | what is superseded soon: divergences, corrected readings, capability, progress, status; replies to peers and refusals |
//! | `inputs` | keeps the latest inputs for those who missed them |

mod events;
#[cfg(test)]
mod input_replay_tests;
mod inputs;
mod routine;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::time::Instant;

use shell::supervision::{Crew, Ended};
use tokio::sync::mpsc;
use vocabulary::Occurrences;
use vocabulary::PublisherCounters;
use zenoh::pubsub::Publisher;

use super::store::ModuleStore;
use crate::counters::SharedCounters;

pub(crate) use events::{EventPublisher, OutgoingEvent};
pub(crate) use inputs::InputCache;
pub(crate) use routine::{Audiences, RoutineMessage, RoutinePublisher};

use events::WaitingEvent;

const QUEUE: usize = 8192;
/// Room that refusals leave to answers and status: malformed queries crowd nothing out.
const KEPT_FREE: usize = QUEUE - 1024;

/// Takes what is to go out. When the last copy is gone, the threads end with what is in their queues, the one that
/// writes the journal too.
#[derive(Debug, Clone)]
pub(crate) struct ModuleOutbox {
    events: SyncSender<WaitingEvent>,
    routine: mpsc::Sender<RoutineMessage>,
    /// The subscribers of frequent messages; without any, these need not be handed in.
    pub(crate) audiences: Audiences,
    shared: Arc<SharedOutbox>,
}

#[derive(Debug)]
struct SharedOutbox {
    store: ModuleStore,
    counters: SharedCounters<PublisherCounters>,
    /// Lines on the events that were lost.
    losses: Occurrences,
}

impl Drop for SharedOutbox {
    fn drop(&mut self) {
        self.store.close();
    }
}

impl ModuleOutbox {
    /// Starts the threads.
    pub(crate) fn open(
        store: ModuleStore,
        events: EventPublisher,
        routine: RoutinePublisher,
        crew: &Crew,
    ) -> std::io::Result<(Self, Vec<Ended>)> {
        let (events_in, events_out) = sync_channel(QUEUE);
        let (routine_in, routine_out) = mpsc::channel(QUEUE);
        let audiences = routine.audiences();
        let ended = vec![
            crew.thread("events", move |lane| events.run(&events_out, lane))?,
            crew.thread("routine", move |lane| routine.run(routine_out, lane))?,
        ];
        Ok((Self::new(store, events_in, routine_in, audiences), ended))
    }

    fn new(
        store: ModuleStore,
        events: SyncSender<WaitingEvent>,
        routine: mpsc::Sender<RoutineMessage>,
        audiences: Audiences,
    ) -> Self {
        let (counters, losses) = (SharedCounters::default(), Occurrences::default());
        Self {
            events,
            routine,
            audiences,
            shared: Arc::new(SharedOutbox { store, counters, losses }),
        }
    }

    /// Hands an event to the store, then queues it for publishing.
    pub(crate) fn event(&self, event: OutgoingEvent) {
        let store = &self.shared.store;
        // Locked until the event is in both queues: journal and publication keep the same order for any caller.
        let mut state = store.lock();
        if let Some(queued) = state.enter(event, Instant::now()) {
            self.publish(queued);
        }
        store.unlock(state);
    }

    /// Queues an event that is in the store for publishing. If the network has been stalled for so long that the queue
    /// is full, the event is dropped for subscribers and counted; queries still return it.
    pub(crate) fn publish(&self, queued: WaitingEvent) {
        let is_reply = matches!(queued.event, OutgoingEvent::Obeyed { .. });
        self.shared.counters.count(|counters| counters.events += u64::from(!is_reply));
        if let Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) =
            self.events.try_send(queued)
        {
            self.count_loss(is_reply);
        }
    }

    fn count_loss(&self, is_reply: bool) {
        self.shared.counters.count(|counters| match is_reply {
            true => counters.replies_lost += 1,
            false => counters.events_lost += 1,
        });
        if let Some(times) = self.shared.losses.note(Instant::now()) {
            let what = if is_reply { "reply" } else { "event" };
            tracing::error!(times, "{what} dropped: outgoing queue full");
        }
    }

    /// Queues a routine message, or drops it if the queue is full; dropped replies are counted.
    pub(crate) fn routine(&self, message: RoutineMessage) {
        let (reply, room) = match message {
            RoutineMessage::Refusal { .. } => (true, self.routine.capacity() > KEPT_FREE),
            RoutineMessage::Answer { .. } => (true, true),
            _ => (false, true),
        };
        let taken = room && self.routine.try_send(message).is_ok();
        if reply && !taken {
            self.shared.counters.count(|counters| counters.replies_lost += 1);
        }
    }

    pub(crate) fn counters(&self) -> PublisherCounters {
        self.shared.counters.read()
    }
}

/// Whether a publisher has subscribers, for as long as it is declared: a message without one need not be published.
#[derive(Debug, Clone, Default)]
pub(crate) struct Audience(Arc<AtomicBool>);

impl Audience {
    /// Follows subscribers as they come and go.
    async fn of(publisher: &Publisher<'_>) -> zenoh::Result<Self> {
        let audience = Self::default();
        let noted = audience.clone();
        publisher
            .matching_listener()
            .callback(move |status| noted.0.store(status.matching(), Ordering::Relaxed))
            .background()
            .await?;
        // The listener reports changes only; a subscriber may have been there before it.
        if publisher.matching_status().await?.matching() {
            audience.0.store(true, Ordering::Relaxed);
        }
        Ok(audience)
    }

    /// Is there a subscriber?
    pub(crate) fn is_there(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;
