//! Rate limiting of log messages: the first occurrence is logged at once, further ones once a minute with their count.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Interval between log messages of one kind.
const AGAIN: Duration = Duration::from_secs(60);

/// Counts occurrences of one kind and decides which ones to log.
#[derive(Debug, Default)]
pub struct Occurrences {
    /// The time of the latest log message, and the number of occurrences since.
    logged: Mutex<(Option<Instant>, u64)>,
}

impl Occurrences {
    /// Counts an occurrence. If it is to be logged, returns the number since the latest log message, including this
    /// one.
    pub fn note(&self, now: Instant) -> Option<u64> {
        let mut logged = self.logged.lock().unwrap_or_else(PoisonError::into_inner);
        let (latest, since) = &mut *logged;
        *since += 1;
        if latest.is_some_and(|latest| now.saturating_duration_since(latest) < AGAIN) {
            return None;
        }
        *latest = Some(now);
        Some(std::mem::take(since))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_has_a_line_at_once_and_the_others_once_a_minute() {
        let (occurrences, start) = (Occurrences::default(), Instant::now());
        let mut lines = Vec::new();
        for second in 0..150 {
            let times = occurrences.note(start + Duration::from_secs(second));
            lines.extend(times.map(|times| (second, times)));
        }
        assert_eq!(lines, [(0, 1), (60, 60), (120, 60)]);
        // After months it has a line at once, however often it happened before.
        let months = Duration::from_secs(10_000_000);
        assert_eq!(occurrences.note(start + months), Some(30));
    }
}
