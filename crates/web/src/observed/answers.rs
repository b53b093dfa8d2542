//! A short-lived cache of answers: concurrent requests for the same answer share one query.

use std::collections::HashMap;
use std::future::Future;
use std::hash::Hash;
use std::sync::Arc;
use std::time::Duration;

use parking_lot::Mutex;
use tokio::sync::Mutex as Turn;
use tokio::time::Instant;

/// Above this size, expired answers are removed.
const MANY: usize = 64;

type Entry<V> = Arc<Turn<Option<(Instant, V)>>>;

/// Answers by request.
#[derive(Debug)]
pub(super) struct Answers<K, V> {
    entries: Mutex<HashMap<K, Entry<V>>>,
    keep: Duration,
}

impl<K: Clone + Eq + Hash, V: Clone> Answers<K, V> {
    pub(super) fn new(keep: Duration) -> Self {
        Self { entries: Mutex::default(), keep }
    }

    /// The cached answer if it is fresh, otherwise that of `fetch`.
    pub(super) async fn get<F>(&self, key: K, fetch: impl FnOnce() -> F) -> V
    where
        F: Future<Output = V>,
    {
        let entry = self.entry(key);
        let mut turn = entry.lock().await;
        if let Some((had, answer)) = &*turn
            && had.elapsed() < self.keep
        {
            return answer.clone();
        }
        let answer = fetch().await;
        *turn = Some((Instant::now(), answer.clone()));
        answer
    }

    fn entry(&self, key: K) -> Entry<V> {
        let mut entries = self.entries.lock();
        if entries.len() >= MANY {
            let fresh = |had: &Instant| had.elapsed() < self.keep;
            entries.retain(|_, entry| match entry.try_lock() {
                Ok(turn) => turn.as_ref().is_some_and(|(had, _)| fresh(had)),
                Err(_) => true,
            });
        }
        Arc::clone(entries.entry(key).or_default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU32, Ordering};

    #[tokio::test]
    async fn whoever_wants_the_same_meanwhile_gets_the_same() {
        let answers: Answers<&str, u32> = Answers::new(Duration::from_secs(3600));
        let fetched = AtomicU32::new(0);
        let fetch = || async {
            tokio::task::yield_now().await;
            fetched.fetch_add(1, Ordering::Relaxed)
        };
        let both = tokio::join!(answers.get("m1", fetch), answers.get("m1", fetch));
        assert_eq!(both, (0, 0));
        assert_eq!(answers.get("m2", fetch).await, 1);
        assert_eq!(answers.get("m1", fetch).await, 0);
    }

    #[tokio::test]
    async fn what_is_old_is_had_anew_and_not_kept_for_ever() {
        let answers: Answers<usize, usize> = Answers::new(Duration::ZERO);
        for number in 0..10 * MANY {
            assert_eq!(answers.get(number, || async { number }).await, number);
        }
        assert_eq!(answers.get(7, || async { 8 }).await, 8);
        assert!(answers.entries.lock().len() <= MANY);
    }
}
