//! Messages far longer than any that a process may send, which a receiver would have to keep whole.

use zenoh::Session;
use zenoh::bytes::ZBytes;
use zenoh::qos::{CongestionControl, Priority};

/// A receiver that does not keep them takes no more than this on top of what it had \[KiB\]: several unfinished
/// messages of the longest kind, and less than one of these.
pub const LARGE_ROOM_KIB: u64 = 24 << 10;
/// Of one message: 64 times what the longest one of ours has.
const LARGE_BYTES: usize = 64 * vocabulary::MAX_MESSAGE_BYTES;
/// A receiver keeps the parts of the messages of each priority apart.
const PRIORITIES: [Priority; 3] = [Priority::InteractiveHigh, Priority::Data, Priority::Background];

/// Publishes messages of 64 MiB, one of each of some priorities; returns once they are on their way.
pub async fn put_large(session: &Session, key: &str) {
    let message = ZBytes::from(vec![b' '; LARGE_BYTES]);
    for priority in PRIORITIES {
        let put = session.put(key, message.clone()).congestion_control(CongestionControl::Block);
        put.priority(priority).await.unwrap();
    }
}
