//! Junk in place of a peer's answers.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

/// Somebody who answers every question on a key with very many words, none of which is an answer.
pub struct Stranger {
    told: Arc<AtomicU64>,
    queryable: Queryable<()>,
}

impl Stranger {
    /// Answers on a key, each question with so many replies.
    pub async fn on(session: &Session, key: &'static str, replies: u64) -> Self {
        let told = Arc::<AtomicU64>::default();
        let counter = Arc::clone(&told);
        let callback = move |query: Query| {
            let counter = Arc::clone(&counter);
            // The network's own thread has other things to do.
            std::thread::spawn(move || answer(&query, key, replies, &counter));
        };
        let queryable = session.declare_queryable(key).complete(true).callback(callback);
        Self { told, queryable: queryable.await.unwrap() }
    }

    /// How many replies have gone out.
    #[must_use]
    pub fn told(&self) -> u64 {
        self.told.load(Ordering::Relaxed)
    }

    /// Says no more.
    pub async fn leave(self) {
        self.queryable.undeclare().await.unwrap();
    }
}

fn answer(query: &Query, key: &str, replies: u64, told: &AtomicU64) {
    let words: [&[u8]; 4] = [b"{\"v\":1}", &[0xff; 300], b"[[[[", &[b' '; 1 << 16]];
    for word in words.iter().cycle().take(replies as usize) {
        if query.reply(key, *word).wait().is_err() {
            return;
        }
        told.fetch_add(1, Ordering::Relaxed);
    }
}
