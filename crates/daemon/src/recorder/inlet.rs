//! Takes messages from the network into a bounded queue. What finds no room is counted.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use parking_lot::Mutex;
use shell::clock;
use tokio::sync::mpsc;
use zenoh::sample::{Sample, SampleKind};

use super::Sender;
use super::continuity::Gap;

/// Most bytes of messages that may wait to be written.
const BYTES: usize = 64 << 20;
/// From one sign that time has passed to the next.
const TICK: Duration = Duration::from_millis(200);

/// What the pen takes.
#[derive(Debug)]
pub(super) enum Arrival {
    /// A message as it was published.
    Published(Message),
    /// One that was asked for.
    Fetched(Message),
    /// What was asked for has come as far as it ever will.
    Settled(Gap),
    /// Time has passed.
    Tick,
}

/// A message with the time of its reception \[ns since 1970\].
#[derive(Debug)]
pub(super) struct Message {
    pub(super) topic: String,
    pub(super) payload: Vec<u8>,
    pub(super) at_unix_ns: u64,
}

/// How many messages of each topic found no room.
#[derive(Debug, Default)]
pub(super) struct Dropped(Mutex<BTreeMap<String, u64>>);

/// The way into the queue.
#[derive(Debug, Clone)]
pub(super) struct Inlet {
    queue: Sender<Arrival>,
    waiting: Arc<AtomicUsize>,
    dropped: Arc<Dropped>,
}

/// The queue's other end.
#[derive(Debug)]
pub(super) struct Outlet {
    queue: mpsc::Receiver<Arrival>,
    waiting: Arc<AtomicUsize>,
}

impl Message {
    pub(super) fn of(sample: &Sample) -> Self {
        let topic = sample.key_expr().as_str().to_owned();
        let payload = sample.payload().to_bytes().into_owned();
        Self { topic, payload, at_unix_ns: clock::unix_ns() }
    }
}

impl Arrival {
    fn bytes(&self) -> usize {
        match self {
            Arrival::Published(message) | Arrival::Fetched(message) => message.payload.len(),
            Arrival::Settled(_) | Arrival::Tick => 0,
        }
    }
}

impl Dropped {
    fn count(&self, topic: &str) {
        let mut dropped = self.0.lock();
        *dropped.entry(topic.to_owned()).or_default() += 1;
    }

    /// What was dropped since this was last asked.
    pub(super) fn take(&self) -> BTreeMap<String, u64> {
        std::mem::take(&mut *self.0.lock())
    }
}

impl Inlet {
    pub(super) fn new(room: usize) -> (Self, Outlet) {
        let (queue, outlet) = mpsc::channel(room);
        let waiting = Arc::<AtomicUsize>::default();
        let outlet = Outlet { queue: outlet, waiting: Arc::clone(&waiting) };
        (Self { queue, waiting, dropped: Arc::default() }, outlet)
    }

    pub(super) fn dropped(&self) -> Arc<Dropped> {
        Arc::clone(&self.dropped)
    }

    /// Takes what was published, on the network's own thread.
    pub(super) fn take(&self, sample: &Sample) {
        if sample.kind() != SampleKind::Put {
            return;
        }
        let bytes = sample.payload().len();
        let has_room = self.waiting.load(Ordering::Relaxed).saturating_add(bytes) <= BYTES;
        let queued = has_room.then(|| self.queue.try_reserve().ok()).flatten();
        match queued {
            Some(place) => {
                self.waiting.fetch_add(bytes, Ordering::Relaxed);
                place.send(Arrival::Published(Message::of(sample)));
            }
            None => self.dropped.count(sample.key_expr().as_str()),
        }
    }

    /// Waits for room.
    pub(super) async fn put(&self, arrival: Arrival) {
        self.waiting.fetch_add(arrival.bytes(), Ordering::Relaxed);
        // Fails only when the pen has ended.
        let _ = self.queue.send(arrival).await;
    }
}

impl Outlet {
    /// Waits for more; false when there will be none.
    pub(super) fn wait(&mut self, into: &mut Vec<Arrival>) -> bool {
        let count = self.queue.blocking_recv_many(into, 1024);
        let bytes = into.iter().map(Arrival::bytes).sum();
        self.waiting.fetch_sub(bytes, Ordering::Relaxed);
        count > 0
    }

    /// Is there nothing at present?
    pub(super) fn is_empty(&self) -> bool {
        self.queue.is_empty()
    }
}

/// The pen looks at the clock when something comes; this comes in any case.
pub(super) async fn tick(inlet: Inlet) {
    loop {
        tokio::time::sleep(TICK).await;
        inlet.put(Arrival::Tick).await;
    }
}
