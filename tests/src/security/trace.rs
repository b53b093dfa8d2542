//! What a refusal leaves in a log.

use std::time::{Duration, Instant};

/// A trace in a log takes no longer than this.
const TRACE: Duration = Duration::from_secs(30);
const GLANCE: Duration = Duration::from_millis(20);

/// The line of a log with all of these words, as soon as there is one.
pub(super) async fn line_of(log: impl Fn() -> String, words: &[&str]) -> Option<String> {
    let start = Instant::now();
    while start.elapsed() < TRACE {
        let log = log();
        let line = log.lines().find(|line| words.iter().all(|word| line.contains(word)));
        if let Some(line) = line {
            return Some(line.to_owned());
        }
        tokio::time::sleep(GLANCE).await;
    }
    None
}
