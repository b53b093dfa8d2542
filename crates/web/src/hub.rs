//! Work that goes on only while somebody looks at what comes of it, once for all who look.

use std::collections::HashMap;
use std::fmt;
use std::future::Future;
use std::hash::Hash;
use std::sync::Arc;
use std::time::Duration;

use parking_lot::Mutex;
use tokio::sync::watch::{Receiver, Sender, channel};

/// How long work goes on after the last has looked away: a reload does not begin it anew.
pub(crate) const LINGER: Duration = Duration::from_secs(10);

/// Each work by its key, with the latest that came of it.
pub(crate) struct Hub<K, V> {
    running: Arc<Mutex<HashMap<K, Sender<V>>>>,
    /// How long it goes on after the last has looked away.
    linger: Duration,
}

impl<K, V> fmt::Debug for Hub<K, V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Hub").field("linger", &self.linger).finish_non_exhaustive()
    }
}

impl<K, V> Hub<K, V>
where
    K: Clone + Eq + Hash + Send + Sync + 'static,
    V: Send + Sync + 'static,
{
    pub(crate) fn new(linger: Duration) -> Self {
        Self { running: Arc::default(), linger }
    }

    /// Looks at the work of this key; if there is none, it is begun, with `first` until something comes of it.
    pub(crate) fn look<F>(&self, key: K, first: V, work: impl FnOnce(Sender<V>) -> F) -> Receiver<V>
    where
        F: Future<Output = ()> + Send + 'static,
    {
        let mut running = self.running.lock();
        if let Some(sender) = running.get(&key) {
            return sender.subscribe();
        }
        let (sender, receiver) = channel(first);
        running.insert(key.clone(), sender.clone());
        let (all, linger, work) = (Arc::clone(&self.running), self.linger, work(sender.clone()));
        tokio::spawn(async move {
            tokio::select! {
                () = work => { all.lock().remove(&key); }
                () = abandoned(&all, &key, &sender, linger) => {}
            }
        });
        receiver
    }

    /// How much work goes on.
    #[cfg(test)]
    pub(crate) fn len(&self) -> usize {
        self.running.lock().len()
    }
}

/// Resolves when nobody has looked for a while; then the work is no longer listed.
async fn abandoned<K: Eq + Hash, V>(
    all: &Mutex<HashMap<K, Sender<V>>>,
    key: &K,
    sender: &Sender<V>,
    linger: Duration,
) {
    loop {
        sender.closed().await;
        tokio::time::sleep(linger).await;
        if removed(all, key, sender) {
            return;
        }
    }
}

/// Under the lock, so that nobody begins to look at what ends.
fn removed<K: Eq + Hash, V>(
    all: &Mutex<HashMap<K, Sender<V>>>,
    key: &K,
    sender: &Sender<V>,
) -> bool {
    let mut all = all.lock();
    let abandoned = sender.receiver_count() == 0;
    if abandoned {
        all.remove(key);
    }
    abandoned
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU32, Ordering};

    const SOON: Duration = Duration::from_secs(60);

    async fn until_idle<V: Send + Sync + 'static>(hub: &Hub<&'static str, V>) {
        let idle = async {
            while hub.len() > 0 {
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        tokio::time::timeout(SOON, idle).await.unwrap();
    }

    #[tokio::test]
    async fn work_is_done_once_for_all_who_look_and_ends_after_the_last_has_looked_away() {
        let begun = Arc::new(AtomicU32::new(0));
        let look = |hub: &Hub<&'static str, u32>| {
            let begun = Arc::clone(&begun);
            hub.look("m1", 0, move |sender| async move {
                sender.send_replace(1 + begun.fetch_add(1, Ordering::Relaxed));
                std::future::pending::<()>().await;
            })
        };
        let hub = Hub::new(Duration::from_millis(20));
        let (mut first, second) = (look(&hub), look(&hub));
        first.changed().await.unwrap();
        assert_eq!((*first.borrow(), *second.borrow(), hub.len()), (1, 1, 1));
        drop((first, second));
        until_idle(&hub).await;
        let mut again = look(&hub);
        again.changed().await.unwrap();
        assert_eq!(*again.borrow(), 2);
    }

    #[tokio::test]
    async fn whoever_looks_again_soon_finds_the_same_work() {
        let hub: Hub<&str, u32> = Hub::new(SOON);
        let mut first = hub.look("m1", 0, |sender| async move {
            sender.send_replace(5);
            std::future::pending::<()>().await;
        });
        first.changed().await.unwrap();
        drop(first);
        tokio::task::yield_now().await;
        assert_eq!(*hub.look("m1", 0, |_| std::future::pending()).borrow(), 5);
    }

    #[tokio::test]
    async fn work_that_has_ended_is_begun_once_more() {
        let hub: Hub<&str, u32> = Hub::new(Duration::from_secs(10));
        let mut first = hub.look("m1", 0, |_| async {});
        // The sender is dropped with the work.
        assert!(first.changed().await.is_err());
        until_idle(&hub).await;
        let second = hub.look("m1", 7, |_| std::future::pending());
        assert_eq!(*second.borrow(), 7);
    }
}
