//! Shares background work among viewers: each task runs once for all its viewers, and only while there are any.

use std::collections::HashMap;
use std::fmt;
use std::future::Future;
use std::hash::Hash;
use std::sync::Arc;
use std::time::Duration;

use parking_lot::Mutex;
use tokio::sync::watch::{Receiver, Sender, channel};

/// How long a task runs on without viewers, so that reloading a page does not restart it.
pub(crate) const LINGER: Duration = Duration::from_secs(10);

/// The running tasks by key, each with its latest result.
pub(crate) struct Hub<K, V> {
    running: Arc<Mutex<HashMap<K, Sender<V>>>>,
    /// How long a task runs on without viewers.
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

    /// Subscribes to the task with this key; starts it if it is not running, with `first` as the initial result.
    pub(crate) fn subscribe<F>(
        &self,
        key: K,
        first: V,
        work: impl FnOnce(Sender<V>) -> F,
    ) -> Receiver<V>
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

    /// The number of running tasks.
    #[cfg(test)]
    pub(crate) fn len(&self) -> usize {
        self.running.lock().len()
    }
}

/// Resolves once the task has had no viewers for a while, and removes it from the list.
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

/// Checks and removes under the lock, so that no viewer subscribes to a task that is ending.
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
    async fn work_is_shared_by_all_streams_and_ends_after_the_last() {
        let begun = Arc::new(AtomicU32::new(0));
        let look = |hub: &Hub<&'static str, u32>| {
            let begun = Arc::clone(&begun);
            hub.subscribe("m1", 0, move |sender| async move {
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
        let mut first = hub.subscribe("m1", 0, |sender| async move {
            sender.send_replace(5);
            std::future::pending::<()>().await;
        });
        first.changed().await.unwrap();
        drop(first);
        tokio::task::yield_now().await;
        assert_eq!(*hub.subscribe("m1", 0, |_| std::future::pending()).borrow(), 5);
    }

    #[tokio::test]
    async fn work_that_has_ended_is_begun_once_more() {
        let hub: Hub<&str, u32> = Hub::new(Duration::from_secs(10));
        let mut first = hub.subscribe("m1", 0, |_| async {});
        // The sender is dropped with the work.
        assert!(first.changed().await.is_err());
        until_idle(&hub).await;
        let second = hub.subscribe("m1", 7, |_| std::future::pending());
        assert_eq!(*second.borrow(), 7);
    }
}
