//! Messages that are malformed or hostile, and how to send very many of them.
//!
//! | file | what |
//! |---|---|
//! | `samples` | samples that none may be taken for a measurement |
//! | `questions` | questions and orders, on every key that a diagnoser answers on |
//! | `pouring` | samples at full rate |
//! | `asking` | questions at full rate, many under way at a time |
//! | `stranger` | junk in place of a peer's answers |

mod asking;
mod pouring;
mod questions;
mod samples;
mod stranger;

use daemon::config::Network;
use zenoh::Session;

pub use asking::{Replies, ask_many};
pub use pouring::{pour, pour_long};
pub use questions::{Questions, questions};
pub use samples::{Fate, HostileSample, hostile_samples, long_samples, oversized_sample};
pub use stranger::Stranger;

/// A session with these endpoints that waits for as long as it takes where the network is full: what it
/// sends is not lost, however busy the other side is.
pub async fn patient_session(endpoints: &[String]) -> Session {
    let mut config = daemon::session::settings(&Network::peer_of(endpoints)).unwrap();
    let waiting = "transport/link/tx/queue/congestion_control/block/wait_before_close";
    config.insert_json5(waiting, "60000000").unwrap();
    config.insert_json5("transport/link/tx/lease", "60000").unwrap();
    zenoh::open(config).await.unwrap()
}
