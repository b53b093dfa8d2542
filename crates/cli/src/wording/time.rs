//! Times of day.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// A time in UTC to the millisecond, the same everywhere: `2026-11-21T10:00:01.250Z` (ISO 8601).
pub(crate) fn utc(time_unix_ns: u64) -> String {
    // The largest is in the year 2554; nothing overflows.
    humantime::format_rfc3339_millis(UNIX_EPOCH + Duration::from_nanos(time_unix_ns)).to_string()
}

/// The time now; 0 if the clock stands before 1970.
pub(crate) fn now_unix_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
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
