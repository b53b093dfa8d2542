//! What the system tests share: processes with configurations and ports of their own, an observer,
//! and the same run in one process to hold against them.
//!
//! A failed setup is a failed test: these functions panic with a message.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "test code")]

pub mod arrivals;
pub mod binaries;
pub mod chaos;
pub mod cut_link;
pub mod deployment;
pub mod folder;
pub mod footprint;
mod grid;
pub mod held;
pub mod hostile;
pub mod interposer;
pub mod kills;
pub mod lab;
pub mod noted;
pub mod observer;
pub mod onlooker;
pub mod operate;
pub mod plant_clock;
pub mod process;
pub mod publications;
pub mod quantiles;
pub mod recorder;
pub mod reference;
pub mod scaling;
pub mod scenarios;
pub mod security;
pub mod signs;
pub mod soak;
pub mod throttle;
pub mod timeline;
pub mod turn;
pub mod verdict;
pub mod web_page;
pub mod worst;

use std::future::Future;
use std::time::Duration;

/// No event of a test takes longer than this, on a busy machine either.
pub const LIMIT: Duration = Duration::from_secs(180);

/// Waits for an event, but not for ever.
pub async fn in_time<F: Future>(what: &str, event: F) -> F::Output {
    match tokio::time::timeout(LIMIT, event).await {
        Ok(output) => output,
        Err(_) => panic!("{what} did not happen within {LIMIT:?}"),
    }
}
