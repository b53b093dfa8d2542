//! Takes what is to go out; never waits. Three threads carry it: `event_lane` what must not be lost, `reply_lane` what
//! is known at present to those who ask, `routine_lane` the rest.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::time::Instant;

use shell::occurrences::Occurrences;
use shell::supervision::{Crew, Ended};
use tokio::sync::mpsc;
use wire::PublisherCounters;

use super::event_lane::{EventLane, Outgoing};
use super::reply_lane::{Asked, ReplyLane};
use super::routine_lane::{Audiences, Routine, RoutineLane};

const QUEUE: usize = 8192;
/// Room that refusals leave to answers and status: malformed queries crowd nothing out.
const KEPT_FREE: usize = QUEUE - 1024;

#[derive(Debug, Default)]
struct OutboxTally {
    events: AtomicU64,
    events_lost: AtomicU64,
    replies_lost: AtomicU64,
    /// Lines on the events that were lost.
    losses: Occurrences,
}

/// The way out.
#[derive(Debug, Clone)]
pub(crate) struct Outbox {
    events: SyncSender<Outgoing>,
    questions: SyncSender<Asked>,
    routine: mpsc::Sender<Routine>,
    /// The subscribers of frequent messages; without any, these need not be handed in.
    pub(crate) audiences: Audiences,
    tally: Arc<OutboxTally>,
}

/// What carries it.
pub(crate) struct Lanes {
    pub(crate) events: EventLane,
    pub(crate) replies: ReplyLane,
    pub(crate) routine: RoutineLane,
}

/// Signals that the threads have carried everything.
pub(crate) type Drained = Vec<Ended>;

impl Outbox {
    /// Starts the threads, which end when all outboxes are gone.
    pub(crate) fn open(lanes: Lanes, crew: &Crew) -> std::io::Result<(Self, Drained)> {
        let Lanes { events, replies, routine } = lanes;
        let (events_in, events_out) = sync_channel(QUEUE);
        let (questions, questions_out) = sync_channel(QUEUE);
        let (routine_in, routine_out) = mpsc::channel(QUEUE);
        let audiences = routine.audiences();
        let drained = vec![
            crew.thread("events", move |lane| events.run(&events_out, lane))?,
            crew.thread("replies", move |lane| replies.run(&questions_out, lane))?,
            crew.thread("routine", move |lane| routine.run(routine_out, lane))?,
        ];
        let (events, routine) = (events_in, routine_in);
        Ok((Self { events, questions, routine, audiences, tally: Arc::default() }, drained))
    }

    /// Something that must not be lost. If there is no room, the network has taken nothing for very
    /// long; then it is, and that is counted.
    pub(crate) fn event(&self, event: Outgoing) {
        let counted =
            matches!(event, Outgoing::Fault(_) | Outgoing::Change(_) | Outgoing::Phase(_));
        self.tally.events.fetch_add(u64::from(counted), Ordering::Relaxed);
        let taken = self.events.try_send(event).is_ok();
        if !taken && counted {
            self.tally.events_lost.fetch_add(1, Ordering::Relaxed);
            if let Some(times) = self.tally.losses.note(Instant::now()) {
                tracing::error!(times, "event lost: the network takes nothing");
            }
        }
    }

    /// A question about what is known at present. Whether there was room.
    pub(crate) fn question(&self, asked: Asked) -> bool {
        self.questions.try_send(asked).is_ok()
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
