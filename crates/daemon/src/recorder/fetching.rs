//! Asks for what is missing: publishers keep their latest samples and inputs, and journals have the transitions and
//! identifications. And for what a diagnoser tells who asks: its configuration, its inputs so far, its present states, and
//! its whole state.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use recording::Stamp;
use tokio::sync::{Semaphore, mpsc, watch};
use tokio::task::JoinSet;
use vocabulary::Occurrences;
use vocabulary::{
    FaultTransition, HistoryPage, HistoryQuestion, Identification, InputQuestion, Key, Message,
    ModuleName, RunId, SampleQuestion, Step, StructureName, Topic, delivery::Backoff,
    keys::Watched,
};
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::query::{ConsolidationMode, QueryTarget};
use zenoh::sample::SampleKind;

use super::keys::RecordedKeys;
use super::missing::{Counting, FAULTS, MissingRange, Place};
use super::queue::{EventQueue, ReceivedMessage, RecorderEvent};

/// Requests that may be outstanding.
const OUTSTANDING: usize = 256;
/// Questions that are put at once.
const AT_ONCE: usize = 4;
/// Most messages that are asked for in one question.
const PIECE: u64 = 1024;
/// Most questions about what was before the recorder.
const PIECES: usize = 64;
/// Most replies to one question that are looked at.
const REPLIES: usize = 65_536;
/// How long the network waits for replies.
const WITHIN: Duration = Duration::from_secs(1);
/// Pauses before the same is asked again: a link that broke is made again within a second or two, and a plant that has
/// published its last sample waits no longer than that to be asked.
const PAUSES: Backoff<Duration> =
    Backoff::new(Duration::from_millis(100), Duration::from_millis(400));
/// How often the same is asked in vain after the first time.
const ATTEMPTS: u32 = 12;

/// What is to be asked for.
#[derive(Debug)]
pub(super) enum FetchRequest {
    /// Messages that are missing.
    Missing(MissingRange),
    /// What a diagnoser tells who asks.
    Module(StructureName, ModuleName),
    /// All that it has computed so far.
    State(StructureName, ModuleName),
}

/// The way to the fetcher.
#[derive(Debug, Clone)]
pub(super) struct FetchRequests {
    queue: mpsc::Sender<FetchRequest>,
    /// How many are not fulfilled yet.
    outstanding: watch::Sender<usize>,
}

impl FetchRequests {
    /// With the queue's other end, for [`Fetcher::run`].
    pub(super) fn new() -> (Self, mpsc::Receiver<FetchRequest>) {
        let (queue, queued) = mpsc::channel(OUTSTANDING);
        (Self { queue, outstanding: watch::Sender::new(0) }, queued)
    }

    /// False if too many are outstanding.
    pub(super) fn add(&self, request: FetchRequest) -> bool {
        let counted = self.outstanding.send_if_modified(|count| {
            *count += 1;
            *count <= OUTSTANDING
        });
        let is_taken = counted && self.queue.try_send(request).is_ok();
        if !is_taken {
            self.outstanding.send_modify(|count| *count -= 1);
        }
        is_taken
    }

    /// Waits until every request is fulfilled as far as it will be.
    pub(super) async fn fulfilled(&self) {
        // No error: this holds a sender.
        let _ = self.outstanding.subscribe().wait_for(|count| *count == 0).await;
    }
}

/// Fetches what is requested.
#[derive(Clone)]
pub(super) struct Fetcher {
    session: Session,
    queue: EventQueue,
    /// Of questions, not of requests: one that is asked in vain for seconds holds up no other.
    at_once: Arc<Semaphore>,
}

impl Fetcher {
    pub(super) fn new(session: &Session, queue: EventQueue) -> Self {
        Self { session: session.clone(), queue, at_once: Arc::new(Semaphore::new(AT_ONCE)) }
    }

    /// Fulfils requests as they come.
    pub(super) async fn run(
        self,
        requests: FetchRequests,
        mut queued: mpsc::Receiver<FetchRequest>,
    ) {
        // All of them end with this.
        let mut tasks = JoinSet::new();
        while let Some(request) = queued.recv().await {
            let fetcher = self.clone();
            let outstanding = requests.outstanding.clone();
            tasks.spawn(async move {
                fetcher.fulfil(request).await;
                outstanding.send_modify(|count| *count -= 1);
            });
            while tasks.try_join_next().is_some() {}
        }
    }

    async fn fulfil(&self, request: FetchRequest) {
        match request {
            FetchRequest::Missing(gap) => {
                match (gap.is_past, gap.counting) {
                    (true, Counting::Steps) => self.past(&gap).await,
                    _ => self.missing(&gap).await,
                }
                self.queue.put(RecorderEvent::Settled(gap)).await;
            }
            FetchRequest::Module(structure, module) => self.module(&structure, &module).await,
            FetchRequest::State(structure, module) => {
                let key = Key::of_module(&structure, &module, Topic::Input);
                let selector = format!("{key}?{}", InputQuestion::STATE);
                self.fetch_as(&selector, RecorderEvent::State).await;
            }
        }
    }

    /// Publishers keep the latest, so the latest come first, until one question brings nothing.
    async fn past(&self, gap: &MissingRange) {
        let mut to = gap.to;
        for _ in 0..PIECES {
            let from = to.saturating_sub(PIECE - 1).max(gap.from);
            if self.piece(gap, from, to).await.is_none() || from == gap.from {
                return;
            }
            to = from - 1;
        }
    }

    async fn missing(&self, gap: &MissingRange) {
        let mut from = gap.from;
        for _ in 0..PIECES {
            let to = from.saturating_add(PIECE - 1).min(gap.to);
            self.piece(gap, from, to).await;
            if to == gap.to {
                return;
            }
            from = to + 1;
        }
    }

    /// Asks until the last of them has come, which come in order, or nothing more does. Returns the last that came.
    async fn piece(&self, gap: &MissingRange, mut from: u64, to: u64) -> Option<u64> {
        let mut had = None;
        let mut pauses = PAUSES;
        loop {
            let last = match gap.counting {
                Counting::Sequences => self.history(gap, from, to).await,
                Counting::Steps | Counting::Numbers => self.fetch(&selector(gap, from, to)).await.1,
            };
            match last {
                Some(last) if last >= to => return Some(last),
                Some(last) if last >= from => {
                    (had, from) = (Some(last), last + 1);
                    pauses.succeed();
                }
                _ if pauses.failures() < ATTEMPTS => tokio::time::sleep(pauses.fail()).await,
                _ => return had,
            }
        }
    }

    async fn module(&self, structure: &StructureName, module: &ModuleName) {
        let key = |topic| Key::of_module(structure, module, topic).to_string();
        let mut pauses = PAUSES;
        while pauses.failures() < ATTEMPTS && self.fetch(&key(Topic::Configuration)).await.0 == 0 {
            tokio::time::sleep(pauses.fail()).await;
        }
        self.fetch(&key(Topic::Input)).await;
        let watched = Watched { structure: Some(structure), module: Some(module) };
        if self.fetch(&watched.faults()).await.0 > 0 {
            self.queue.put(RecorderEvent::Heard(watched.faults())).await;
        }
        for expression in [watched.identifications(), watched.phases()] {
            self.fetch(&expression).await;
        }
    }

    /// Asks a module's journal for transitions, with what was found of the faults that they declared. Passes them on as
    /// they would have been published; returns the last that came.
    async fn history(&self, gap: &MissingRange, from: u64, to: u64) -> Option<u64> {
        let _permit = self.at_once.acquire().await;
        let mut replies = self.ask(&selector(gap, from, to)).await;
        let mut last = None;
        while let Some(message) = replies.recv().await {
            let Ok(page) = vocabulary::decode::<HistoryPage>(&message.payload) else { continue };
            let is_wanted = |sequence| (from..=to).contains(&sequence);
            // Of another journal the numbers mean something else.
            let transitions: Vec<FaultTransition> = (page.transitions.into_iter())
                .filter(|one| one.incarnation == gap.epoch && is_wanted(one.sequence))
                .collect();
            last = last.max(transitions.iter().map(|one| one.sequence).max());
            let is_declared = |found: &Identification| {
                transitions.iter().any(|one| one.sequence == found.sequence)
            };
            let found: Vec<Identification> =
                page.identifications.into_iter().filter(is_declared).collect();
            for one in &transitions {
                let topic = Topic::Fault(one.component.component.clone());
                self.pass_on((&one.structure, &one.module, topic), one, &message).await;
            }
            for one in &found {
                let topic = Topic::Identification(one.component.component.clone());
                self.pass_on((&one.structure, &one.module, topic), one, &message).await;
            }
        }
        last
    }

    /// What a page has, as a message on its own topic.
    async fn pass_on(
        &self,
        (structure, module, topic): (&StructureName, &ModuleName, Topic),
        message: &impl Message,
        page: &ReceivedMessage,
    ) {
        // A message that was read is encoded again without failing.
        let Ok(payload) = vocabulary::encode(message) else { return };
        let topic = Key::of_module(structure, module, topic).to_string();
        let message = ReceivedMessage { topic, payload, at_unix_ns: page.at_unix_ns };
        self.queue.put(RecorderEvent::Fetched(message)).await;
    }

    /// Puts a question and passes on the replies: how many came, and the place of the last that is counted.
    async fn fetch(&self, selector: &str) -> (usize, Option<u64>) {
        self.fetch_as(selector, RecorderEvent::Fetched).await
    }

    async fn fetch_as(
        &self,
        selector: &str,
        event: fn(ReceivedMessage) -> RecorderEvent,
    ) -> (usize, Option<u64>) {
        let _permit = self.at_once.acquire().await;
        let mut replies = self.ask(selector).await;
        let (mut had, mut last) = (0, None);
        while let Some(message) = replies.recv().await {
            had += 1;
            let stamp = Stamp::of(&message.payload);
            let place = Place::of(&message.topic, &message.payload, &stamp);
            last = last.max(place.map(|place| place.at));
            self.queue.put(event(message)).await;
        }
        (had, last)
    }

    /// Puts a question. The replies end when the network has dropped the callback.
    async fn ask(&self, selector: &str) -> mpsc::UnboundedReceiver<ReceivedMessage> {
        let (found, replies) = mpsc::unbounded_channel();
        let count = AtomicUsize::new(0);
        let query = self.session.get(selector).target(QueryTarget::All);
        let query = query.consolidation(ConsolidationMode::None).timeout(WITHIN);
        let asked = query.callback(move |reply| {
            if let Ok(sample) = reply.result()
                && count.fetch_add(1, Ordering::Relaxed) < REPLIES
            {
                for message in ReceivedMessage::all_of(sample) {
                    // Fails only when the receiver is gone.
                    let _ = found.send(message);
                }
            }
        });
        if let Err(error) = asked.await {
            tracing::debug!("request for missed messages failed: {error}");
        }
        replies
    }
}

fn selector(gap: &MissingRange, from: u64, to: u64) -> String {
    let mut topic = gap.topic.clone();
    let parameters = match gap.counting {
        Counting::Steps => {
            let (from, to) = (Step(from), Step(to));
            SampleQuestion { run: RunId(gap.epoch), from, to }.to_parameters()
        }
        Counting::Numbers => {
            let (from, to) = (Some(from), Some(to));
            InputQuestion { process: Some(gap.epoch), from, to }.to_parameters()
        }
        Counting::Sequences => {
            if let Some(module) = topic.strip_suffix(FAULTS) {
                topic = format!("{module}{}", Topic::History);
            }
            HistoryQuestion { since: from, limit: to - from + 1 }.to_parameters()
        }
    };
    format!("{topic}?{parameters}")
}

/// Requests what each diagnoser tells, when its token is seen.
pub(super) async fn watch_diagnosers(
    session: &Session,
    keys: &RecordedKeys,
    requests: FetchRequests,
) -> zenoh::Result<Subscriber<()>> {
    let tokens = keys.tokens();
    let keys = keys.clone();
    let refused = Occurrences::default();
    let seen = move |token: zenoh::sample::Sample| {
        if token.kind() == SampleKind::Put
            && keys.has(token.key_expr().as_str())
            && let Some(request) = module_request(token.key_expr().as_str())
            && !requests.add(request)
            && let Some(times) = refused.note(Instant::now())
        {
            let token = token.key_expr();
            tracing::warn!(%token, times, "diagnosers not queried: request queue full");
        }
    };
    session.liveliness().declare_subscriber(tokens).history(true).callback(seen).await
}

/// To ask the module that a key belongs to.
pub(super) fn module_request(key: &str) -> Option<FetchRequest> {
    match key.parse() {
        Ok(Key::Module { structure, module, .. }) => Some(FetchRequest::Module(structure, module)),
        _ => None,
    }
}
