//! Junk in place of a peer's replies.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

/// For the replies to one query. It is less than the querier's time limit: when a query of its own process runs
/// out of time, the network's library waits for room on the same link before it reads anything else, and
/// this process loses all its links.
const TIME: Duration = Duration::from_millis(150);

/// A queryable that replies to every query on a key with very many malformed messages.
pub struct Impostor {
    sent: Arc<AtomicU64>,
    queryable: Queryable<()>,
}

impl Impostor {
    /// Replies on a key, each query with this many messages.
    pub async fn on(session: &Session, key: &'static str, replies: u64) -> Self {
        let sent = Arc::<AtomicU64>::default();
        let counter = Arc::clone(&sent);
        let callback = move |query: Query| {
            let counter = Arc::clone(&counter);
            // The network's own thread must not block.
            std::thread::spawn(move || answer(&query, key, replies, &counter));
        };
        let queryable = session.declare_queryable(key).complete(true).callback(callback);
        Self { sent, queryable: queryable.await.unwrap() }
    }

    /// Number of replies sent.
    #[must_use]
    pub fn sent(&self) -> u64 {
        self.sent.load(Ordering::Relaxed)
    }

    /// Stops replying.
    pub async fn leave(self) {
        self.queryable.undeclare().await.unwrap();
    }
}

fn answer(query: &Query, key: &str, replies: u64, sent: &AtomicU64) {
    let words: [&[u8]; 4] = [b"{\"v\":1}", &[0xff; 300], b"[[[[", &[b' '; 1 << 16]];
    let start = Instant::now();
    for word in words.iter().cycle().take(replies as usize) {
        if start.elapsed() > TIME || query.reply(key, *word).wait().is_err() {
            return;
        }
        sent.fetch_add(1, Ordering::Relaxed);
    }
}
