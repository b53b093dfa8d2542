//! Whether a publisher has subscribers: a message without one need not be published.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use zenoh::pubsub::Publisher;

/// The subscribers of a publisher, for as long as it is declared.
#[derive(Debug, Clone, Default)]
pub(crate) struct Audience(Arc<AtomicBool>);

impl Audience {
    /// Follows subscribers as they come and go.
    pub(crate) async fn of(publisher: &Publisher<'_>) -> zenoh::Result<Self> {
        let audience = Self::default();
        let noted = audience.clone();
        publisher
            .matching_listener()
            .callback(move |status| noted.note(status.matching()))
            .background()
            .await?;
        // The listener reports changes only; a subscriber may have been there before it.
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
