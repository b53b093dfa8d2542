//! Times of day.

use std::time::{Duration, UNIX_EPOCH};

/// A time in UTC to the millisecond, the same everywhere: `2026-11-21T10:00:01.250Z` (ISO 8601).
pub fn utc(time_unix_ns: u64) -> String {
    // The largest is in the year 2554; nothing overflows.
    humantime::format_rfc3339_millis(UNIX_EPOCH + Duration::from_nanos(time_unix_ns)).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_printed_in_utc_whatever_they_are() {
        assert_eq!(utc(0), "1970-01-01T00:00:00.000Z");
        assert_eq!(utc(1_792_540_801_250_999_999), "2026-10-21T00:00:01.250Z");
        assert!(utc(u64::MAX).starts_with("2554-"));
    }
}
