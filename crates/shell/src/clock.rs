//! The time of day, for messages only; decisions must not depend on it.

use std::time::{SystemTime, UNIX_EPOCH};

/// Nanoseconds since 1970; 0 if the clock is set before that.
#[must_use]
pub fn unix_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}
