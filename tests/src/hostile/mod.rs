//! Messages that are malformed or hostile, and how to send very many of them.
//!
//! | file | what |
//! |---|---|
//! | `samples` | samples that none may be taken for a measurement |
//! | `questions` | queries and commands, on every key that a diagnoser answers on |
//! | `pouring` | samples at full rate |
//! | `large` | messages far longer than any of ours |
//! | `query_flood` | queries at full rate, many pending at a time |
//! | `impostor` | junk in place of a peer's replies |

mod impostor;
mod large;
mod pouring;
mod query_flood;
mod questions;
mod samples;

use serde_json::Value;
use session::Network;
use zenoh::Session;

use crate::in_time;

pub use impostor::Impostor;
pub use large::{LARGE_ROOM_KIB, put_large};
pub use pouring::{pour, pour_long};
pub use query_flood::{Replies, ask_many};
pub use questions::{Questions, questions};
pub use samples::{Fate, HostileSample, hostile_samples, long_samples, oversized_sample};

/// A sample as the plant publishes it on this key.
pub async fn true_sample(session: &Session, key: &str) -> Value {
    let samples = session.declare_subscriber(key).await.unwrap();
    let sample = in_time("a sample", samples.recv_async()).await.unwrap();
    serde_json::from_slice(&sample.payload().to_bytes()).unwrap()
}

/// A session with these endpoints that blocks without a timeout on congestion: what it sends is not lost,
/// however busy the receiver is.
pub async fn blocking_session(endpoints: &[String]) -> Session {
    let mut config = session::settings(&Network::peer_of(endpoints)).unwrap();
    let waiting = "transport/link/tx/queue/congestion_control/block/wait_before_close";
    config.insert_json5(waiting, "60000000").unwrap();
    config.insert_json5("transport/link/tx/lease", "60000").unwrap();
    zenoh::open(config).await.unwrap()
}
