//! Takes messages from the network into a bounded queue. What finds no room is counted.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use memchr::memmem;
use parking_lot::Mutex;
use shell::clock;
use tokio::sync::mpsc;
use vocabulary::Encoding;
use zenoh::sample::{Sample, SampleKind};

use super::missing::{Counting, MissingRange};
use crate::messages;

/// Most bytes of messages that may wait to be written.
const BYTES: usize = 64 << 20;
/// From one sign that time has passed to the next.
const TICK: Duration = Duration::from_millis(200);

/// What the writing thread takes.
#[derive(Debug)]
pub(super) enum RecorderEvent {
    /// A message as it was published.
    Published(ReceivedMessage),
    /// One that was fetched.
    Fetched(ReceivedMessage),
    /// A part of a diagnoser's state.
    State(ReceivedMessage),
    /// The present states of the components of a module have been fetched; the key expression of its transitions.
    Heard(String),
    /// What was asked for has come as far as it ever will.
    Settled(MissingRange),
    /// Time has passed.
    Tick,
}

/// A message with the time of its reception \[ns since 1970\].
#[derive(Debug)]
pub(super) struct ReceivedMessage {
    pub(super) topic: String,
    pub(super) payload: Vec<u8>,
    pub(super) at_unix_ns: u64,
}

/// How many messages of each topic found no room.
pub(super) type Dropped = Arc<Mutex<BTreeMap<String, u64>>>;

/// The way into the queue.
#[derive(Debug, Clone)]
pub(super) struct EventQueue {
    queue: mpsc::Sender<RecorderEvent>,
    waiting: Arc<AtomicUsize>,
    dropped: Dropped,
}

/// The queue's other end.
#[derive(Debug)]
pub(super) struct QueuedEvents {
    queue: mpsc::Receiver<RecorderEvent>,
    waiting: Arc<AtomicUsize>,
}

impl ReceivedMessage {
    /// What came; of a block of samples, each step as if it had been published by itself, as JSON. A file then has samples in one
    /// form, each at its step.
    pub(super) fn all_of(sample: &Sample) -> Vec<Self> {
        let topic = sample.key_expr().as_str();
        let (payload, at_unix_ns) = (sample.payload().to_bytes(), clock::unix_ns());
        let message = |payload| Self { topic: topic.to_owned(), payload, at_unix_ns };
        let encoding = messages::encoding_of(sample.encoding());
        let is_plain = Counting::of(topic) != Some(Counting::Steps)
            || encoding == Encoding::Json && memmem::find(&payload, b"\"block\"").is_none();
        let steps = if is_plain { None } else { steps(&payload, encoding) };
        // An invalid sample is recorded verbatim.
        let steps = steps.unwrap_or_else(|| vec![payload.into_owned()]);
        steps.into_iter().map(message).collect()
    }
}

fn steps(payload: &[u8], encoding: Encoding) -> Option<Vec<Vec<u8>>> {
    let steps = vocabulary::Sample::read(payload, encoding).ok()?;
    steps.map(|step| vocabulary::encode(&step).ok()).collect()
}

impl RecorderEvent {
    fn bytes(&self) -> usize {
        match self {
            RecorderEvent::Published(message)
            | RecorderEvent::Fetched(message)
            | RecorderEvent::State(message) => message.payload.len(),
            RecorderEvent::Heard(_) | RecorderEvent::Settled(_) | RecorderEvent::Tick => 0,
        }
    }
}

impl EventQueue {
    pub(super) fn new(room: usize) -> (Self, QueuedEvents) {
        let (queue, receiver) = mpsc::channel(room);
        let waiting = Arc::<AtomicUsize>::default();
        let queued = QueuedEvents { queue: receiver, waiting: Arc::clone(&waiting) };
        (Self { queue, waiting, dropped: Arc::default() }, queued)
    }

    pub(super) fn dropped(&self) -> Dropped {
        Arc::clone(&self.dropped)
    }

    /// Takes what was published, on the network's own thread.
    pub(super) fn take(&self, sample: &Sample) {
        if sample.kind() != SampleKind::Put {
            return;
        }
        ReceivedMessage::all_of(sample).into_iter().for_each(|message| self.take_message(message));
    }

    fn take_message(&self, message: ReceivedMessage) {
        let bytes = message.payload.len();
        let has_room = self.waiting.load(Ordering::Relaxed).saturating_add(bytes) <= BYTES;
        let queued = has_room.then(|| self.queue.try_reserve().ok()).flatten();
        match queued {
            Some(place) => {
                self.waiting.fetch_add(bytes, Ordering::Relaxed);
                place.send(RecorderEvent::Published(message));
            }
            None => *self.dropped.lock().entry(message.topic).or_default() += 1,
        }
    }

    /// Waits for room.
    pub(super) async fn put(&self, arrival: RecorderEvent) {
        self.waiting.fetch_add(arrival.bytes(), Ordering::Relaxed);
        // Fails only when the writing thread has ended.
        let _ = self.queue.send(arrival).await;
    }
}

impl QueuedEvents {
    /// Waits for more; false when there will be none.
    pub(super) fn wait(&mut self, into: &mut Vec<RecorderEvent>) -> bool {
        let count = self.queue.blocking_recv_many(into, 1024);
        let bytes = into.iter().map(RecorderEvent::bytes).sum();
        self.waiting.fetch_sub(bytes, Ordering::Relaxed);
        count > 0
    }

    /// Is there nothing at present?
    pub(super) fn is_empty(&self) -> bool {
        self.queue.is_empty()
    }
}

/// The writing thread looks at the clock when something comes; this comes in any case.
pub(super) async fn tick(queue: EventQueue) {
    loop {
        tokio::time::sleep(TICK).await;
        queue.put(RecorderEvent::Tick).await;
    }
}
