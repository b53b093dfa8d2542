//! What the system tests share: processes with configurations and ports of their own, an observer,
//! and the same run in one process to hold against them.
//!
//! Whatever cannot be set up here is a failed test: these functions stop with a message.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "test code")]

pub mod binaries;
pub mod chaos;
pub mod deployment;
pub mod footprint;
pub mod held;
pub mod hostile;
pub mod kills;
pub mod lab;
pub mod observer;
pub mod onlooker;
pub mod operate;
pub mod plant_clock;
pub mod publications;
pub mod reference;
pub mod resident;
pub mod scaling;
pub mod scenarios;
pub mod security;
pub mod signs;
pub mod soak;
pub mod throttle;
pub mod timeline;
pub mod turn;
pub mod verdict;
pub mod worst;

use std::future::Future;
use std::time::Duration;

/// No event of a test takes longer than this.
pub const LIMIT: Duration = Duration::from_secs(60);

/// Waits for an event, but not for ever.
pub async fn in_time<F: Future>(what: &str, event: F) -> F::Output {
    match tokio::time::timeout(LIMIT, event).await {
        Ok(output) => output,
        Err(_) => panic!("{what} did not happen within {LIMIT:?}"),
    }
}
