//! What a refusal leaves in a log.

use std::time::{Duration, Instant};

use crate::LIMIT;

/// A trace in a log takes no longer than this.
const TRACE: Duration = LIMIT;
const GLANCE: Duration = Duration::from_millis(20);

/// The line of a log with all of these words, as soon as there is one.
pub(super) async fn line_of(log: impl Fn() -> String, words: &[&str]) -> Option<String> {
    let start = Instant::now();
    while start.elapsed() < TRACE {
        if let Some(line) = first_line_of(&log(), words) {
            return Some(line.to_owned());
        }
        tokio::time::sleep(GLANCE).await;
    }
    None
}

/// The first line with all of these words.
pub(super) fn first_line_of<'a>(log: &'a str, words: &[&str]) -> Option<&'a str> {
    log.lines().find(|line| words.iter().all(|word| line.contains(word)))
}
