//! How each kind of message is published.

use std::time::Duration;

use zenoh::Session;
use zenoh::bytes::Encoding;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh_ext::{AdvancedPublisher, AdvancedPublisherBuilderExt, CacheConfig, MissDetectionConfig};

/// Whoever listens learns after at most this time that it missed the latest message.
const HEARTBEAT: Duration = Duration::from_millis(500);

/// A publisher of events: they may hold the sender up, go first, and late listeners get them too.
pub(crate) async fn events(
    session: &Session,
    key: String,
    history: usize,
) -> zenoh::Result<AdvancedPublisher<'static>> {
    session
        .declare_publisher(key)
        .encoding(Encoding::APPLICATION_JSON)
        .congestion_control(CongestionControl::Block)
        .priority(Priority::RealTime)
        .cache(CacheConfig::default().max_samples(history))
        .sample_miss_detection(MissDetectionConfig::default().sporadic_heartbeat(HEARTBEAT))
        .publisher_detection()
        .await
}

/// A publisher of what is superseded soon: dropped rather than waited for.
pub(crate) async fn routine(session: &Session, key: String) -> zenoh::Result<Publisher<'static>> {
    session
        .declare_publisher(key)
        .encoding(Encoding::APPLICATION_JSON)
        .congestion_control(CongestionControl::Drop)
        .await
}
