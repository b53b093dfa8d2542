//! Whether anybody listens: what nobody would hear need not be said.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use zenoh::pubsub::Publisher;

/// Those who listen to a publisher, for as long as it is declared.
#[derive(Debug, Clone, Default)]
pub(crate) struct Audience(Arc<AtomicBool>);

impl Audience {
    /// Looks after whoever comes and goes.
    pub(crate) async fn of(publisher: &Publisher<'_>) -> zenoh::Result<Self> {
        let audience = Self::default();
        let noted = audience.clone();
        publisher
            .matching_listener()
            .callback(move |status| noted.note(status.matching()))
            .background()
            .await?;
        // The listener tells of changes; somebody may have been there before it.
        if publisher.matching_status().await?.matching() {
            audience.note(true);
        }
        Ok(audience)
    }

    /// Is anybody there?
    pub(crate) fn is_there(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    fn note(&self, there: bool) {
        self.0.store(there, Ordering::Relaxed);
    }
}
