//! What arrives, one after the other.

use tokio::sync::mpsc::UnboundedReceiver;

use crate::in_time;

/// What has arrived and was not taken yet, with the time of arrival \[ns since 1970\].
pub struct Arrivals<T, S> {
    waiting: UnboundedReceiver<(u64, T)>,
    _subscribers: S,
}

impl<T, S> Arrivals<T, S> {
    /// What these subscribers hand over.
    pub(crate) fn by(waiting: UnboundedReceiver<(u64, T)>, subscribers: S) -> Self {
        Self { waiting, _subscribers: subscribers }
    }

    /// The next one.
    pub async fn next(&mut self) -> (u64, T) {
        in_time(std::any::type_name::<T>(), self.waiting.recv()).await.unwrap()
    }

    /// What `wanted` makes of the first one of which it makes anything; the others are gone.
    pub async fn find<R>(&mut self, what: &str, mut wanted: impl FnMut(u64, T) -> Option<R>) -> R {
        let found = async {
            loop {
                let (at, arrival) = self.next().await;
                if let Some(found) = wanted(at, arrival) {
                    return found;
                }
            }
        };
        in_time(what, found).await
    }

    /// Everything that has arrived so far.
    pub fn arrived(&mut self) -> Vec<(u64, T)> {
        std::iter::from_fn(|| self.waiting.try_recv().ok()).collect()
    }
}
