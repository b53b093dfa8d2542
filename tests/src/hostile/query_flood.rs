//! Queries at full rate, many pending at a time.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use zenoh::Session;
use zenoh::query::{ConsolidationMode, Reply};

use super::questions::Questions;

/// Queries pending at a time.
const UNDER_WAY: u32 = 512;
/// Longer than any question is held.
const TIMEOUT: Duration = Duration::from_secs(20);

/// Queries and their outcomes as the clients see them.
#[derive(Debug, Clone, Copy, Default)]
pub struct Replies {
    /// Queries sent.
    pub asked: u64,
    /// Malformed ones among them.
    pub malformed: u64,
    /// Replies.
    pub replies: u64,
    /// Refusals, and timeouts reported by the network.
    pub errors: u64,
    /// Queries that ended without a reply.
    pub unheard: u64,
}

#[derive(Debug, Default)]
struct Tally {
    replies: AtomicU64,
    errors: AtomicU64,
    unheard: AtomicU64,
}

/// A pending query; it ends when the network releases it.
struct UnderWay {
    tally: Arc<Tally>,
    heard: AtomicBool,
    _place: OwnedSemaphorePermit,
}

impl UnderWay {
    fn note(&self, reply: &Reply) {
        self.heard.store(true, Ordering::Relaxed);
        let counter = if reply.result().is_ok() { &self.tally.replies } else { &self.tally.errors };
        counter.fetch_add(1, Ordering::Relaxed);
    }
}

impl Drop for UnderWay {
    fn drop(&mut self) {
        if !self.heard.load(Ordering::Relaxed) {
            self.tally.unheard.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// Sends `count` queries, or as many as fit into the time, and waits for their ends.
pub async fn ask_many(
    session: &Session,
    questions: &Questions,
    count: u64,
    time: Duration,
) -> Replies {
    let places = Arc::new(Semaphore::new(UNDER_WAY as usize));
    let (tally, start) = (Arc::<Tally>::default(), Instant::now());
    let (mut asked, mut malformed) = (0, 0);
    while asked < count && start.elapsed() < time {
        let place = Arc::clone(&places).acquire_owned().await.unwrap();
        let (question, senseless) = questions.at(asked);
        ask(
            session,
            question,
            UnderWay { tally: Arc::clone(&tally), heard: AtomicBool::new(false), _place: place },
        )
        .await;
        asked += 1;
        malformed += u64::from(senseless);
    }
    crate::in_time("the last ends", places.acquire_many(UNDER_WAY)).await.unwrap().forget();
    let read = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
    let (replies, errors) = (read(&tally.replies), read(&tally.errors));
    Replies { asked, malformed, replies, errors, unheard: read(&tally.unheard) }
}

async fn ask(
    session: &Session,
    (selector, payload): &super::questions::Question,
    under_way: UnderWay,
) {
    let mut query =
        session.get(selector.as_str()).consolidation(ConsolidationMode::None).timeout(TIMEOUT);
    if let Some(payload) = payload {
        query = query.payload(payload.as_slice());
    }
    query.callback(move |reply| under_way.note(&reply)).await.unwrap();
}
