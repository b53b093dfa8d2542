//! Asks for what is missing: publishers keep their latest samples and inputs. And for what a diagnoser tells who asks:
//! its configuration, its inputs so far, its present states.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use recording::Stamp;
use tokio::sync::{Semaphore, mpsc, watch};
use tokio::task::JoinSet;
use vocabulary::{
    InputQuestion, Key, ModuleName, RunId, SampleQuestion, Step, StructureName, Topic,
    delivery::Backoff, keys::Watched,
};
use zenoh::Session;
use zenoh::query::{ConsolidationMode, QueryTarget};

use super::continuity::{Counting, Gap};
use super::inlet::{Arrival, Inlet, Message};

/// Wishes that may wait.
const WISHES: usize = 256;
/// Wishes that are fulfilled at once.
const AT_ONCE: usize = 4;
/// Most messages that are asked for in one question.
const PIECE: u64 = 1024;
/// Most questions about what was before the recorder.
const PIECES: usize = 64;
/// Most replies to one question that are looked at.
const REPLIES: usize = 65_536;
/// How long the network waits for replies.
const WITHIN: Duration = Duration::from_secs(1);
/// Pauses before the same is asked again: a link that broke is made again within a second or two.
const PAUSES: Backoff<Duration> =
    Backoff::new(Duration::from_millis(300), Duration::from_millis(2400));
/// How often the same is asked in vain after the first time.
const ATTEMPTS: u32 = 4;

/// What is to be asked for.
#[derive(Debug)]
pub(super) enum Wish {
    /// Messages that are missing.
    Missing(Gap),
    /// What a diagnoser tells who asks.
    Module(StructureName, ModuleName),
}

/// Where wishes are brought.
#[derive(Debug, Clone)]
pub(super) struct Desk {
    queue: mpsc::Sender<Wish>,
    /// How many are not fulfilled yet.
    outstanding: watch::Sender<usize>,
}

impl Desk {
    /// False if there is no room.
    pub(super) fn bring(&self, wish: Wish) -> bool {
        self.outstanding.send_modify(|count| *count += 1);
        let is_taken = self.queue.try_send(wish).is_ok();
        if !is_taken {
            self.outstanding.send_modify(|count| *count -= 1);
        }
        is_taken
    }

    /// Waits until every wish is fulfilled as far as it will be.
    pub(super) async fn fulfilled(&self) {
        // No error: this holds a sender.
        let _ = self.outstanding.subscribe().wait_for(|count| *count == 0).await;
    }
}

/// Fulfils wishes.
pub(super) struct Fetcher {
    session: Session,
    inlet: Inlet,
    desk: Desk,
    wishes: mpsc::Receiver<Wish>,
}

impl Fetcher {
    pub(super) fn new(session: &Session, inlet: Inlet) -> (Self, Desk) {
        let (queue, wishes) = mpsc::channel(WISHES);
        let desk = Desk { queue, outstanding: watch::Sender::new(0) };
        (Self { session: session.clone(), inlet, desk: desk.clone(), wishes }, desk)
    }

    pub(super) fn desk(&self) -> Desk {
        self.desk.clone()
    }

    pub(super) async fn run(mut self) {
        let at_once = Arc::new(Semaphore::new(AT_ONCE));
        // All of them end with this.
        let mut tasks = JoinSet::new();
        while let Some(wish) = self.wishes.recv().await {
            let Ok(permit) = Arc::clone(&at_once).acquire_owned().await else { return };
            let errand = Errand { session: self.session.clone(), inlet: self.inlet.clone() };
            let outstanding = self.desk.outstanding.clone();
            tasks.spawn(async move {
                errand.fulfil(wish).await;
                outstanding.send_modify(|count| *count -= 1);
                drop(permit);
            });
            while tasks.try_join_next().is_some() {}
        }
    }
}

/// Fulfils one wish.
struct Errand {
    session: Session,
    inlet: Inlet,
}

impl Errand {
    async fn fulfil(&self, wish: Wish) {
        match wish {
            Wish::Missing(gap) => {
                match (gap.is_past, gap.counting) {
                    (true, Counting::Steps) => self.past(&gap).await,
                    _ => self.missing(&gap).await,
                }
                self.inlet.put(Arrival::Settled(gap)).await;
            }
            Wish::Module(structure, module) => self.module(&structure, &module).await,
        }
    }

    /// Publishers keep the latest, so the latest come first, until one question brings nothing.
    async fn past(&self, gap: &Gap) {
        let mut to = gap.to;
        for _ in 0..PIECES {
            let from = to.saturating_sub(PIECE - 1).max(gap.from);
            if self.piece(gap, from, to).await.is_none() || from == gap.from {
                return;
            }
            to = from - 1;
        }
    }

    async fn missing(&self, gap: &Gap) {
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
    async fn piece(&self, gap: &Gap, mut from: u64, to: u64) -> Option<u64> {
        let mut had = None;
        let mut pauses = PAUSES;
        loop {
            match self.fetch(&selector(gap, from, to)).await.last {
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
        while pauses.failures() < ATTEMPTS
            && self.fetch(&key(Topic::Configuration)).await.count == 0
        {
            tokio::time::sleep(pauses.fail()).await;
        }
        self.fetch(&key(Topic::Input)).await;
        let watched = Watched { structure: Some(structure), module: Some(module) };
        for expression in [watched.faults(), watched.identifications(), watched.phases()] {
            self.fetch(&expression).await;
        }
    }

    /// Puts a question and passes on the replies.
    async fn fetch(&self, selector: &str) -> Had {
        let (found, mut replies) = mpsc::unbounded_channel();
        let count = AtomicUsize::new(0);
        let query = self.session.get(selector).target(QueryTarget::All);
        let query = query.consolidation(ConsolidationMode::None).timeout(WITHIN);
        let asked = query.callback(move |reply| {
            if let Ok(sample) = reply.result()
                && count.fetch_add(1, Ordering::Relaxed) < REPLIES
            {
                // Fails only when nobody waits any more.
                let _ = found.send(Message::of(sample));
            }
        });
        if let Err(error) = asked.await {
            tracing::debug!("not asked: {error}");
        }
        let mut had = Had::default();
        // Ends when the network has dropped the callback.
        while let Some(message) = replies.recv().await {
            had.count += 1;
            let counting = Counting::of(&message.topic);
            let at = counting.and_then(|counting| counting.place(&Stamp::of(&message.payload)));
            had.last = had.last.max(at.map(|(_, at)| at));
            self.inlet.put(Arrival::Fetched(message)).await;
        }
        had
    }
}

/// What a question brought.
#[derive(Debug, Default)]
struct Had {
    count: usize,
    /// The place of the last that is counted.
    last: Option<u64>,
}

fn selector(gap: &Gap, from: u64, to: u64) -> String {
    let parameters = match gap.counting {
        Counting::Steps => {
            let (from, to) = (Step(from), Step(to));
            SampleQuestion { run: RunId(gap.epoch), from, to }.to_parameters()
        }
        Counting::Numbers => {
            let (from, to) = (Some(from), Some(to));
            InputQuestion { process: Some(gap.epoch), from, to }.to_parameters()
        }
    };
    format!("{}?{parameters}", gap.topic)
}
