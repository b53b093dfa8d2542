//! Times of day.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// A time in UTC to the millisecond, the same everywhere: `2026-11-21T10:00:01.250Z` (ISO 8601).
pub fn utc(time_unix_ns: u64) -> String {
    // The largest is in the year 2554; nothing overflows.
    humantime::format_rfc3339_millis(UNIX_EPOCH + Duration::from_nanos(time_unix_ns)).to_string()
}

/// Reads a time in UTC \[ns since 1970\], as people and HTML's time fields write it: with or without a time of
/// day, seconds, fractions of a second and `Z`.
///
/// # Errors
///
/// The text, and what would be right.
pub fn parse_utc(text: &str) -> Result<u64, String> {
    let rest = match text.len() {
        10 => " 00:00:00",
        16 => ":00",
        _ => "",
    };
    let whole = format!("{text}{rest}");
    humantime::parse_rfc3339_weak(&whole)
        .ok()
        .and_then(since_1970)
        .ok_or_else(|| format!("invalid time `{text}`: expected UTC, e.g. `2026-11-21T10:00:00Z`"))
}

/// The same, or a time before now: `2h`, `30min`.
///
/// # Errors
///
/// The text, and what would be right.
pub fn parse_utc_or_ago(text: &str, now: SystemTime) -> Result<u64, String> {
    let ago = humantime::parse_duration(text).ok();
    match ago.and_then(|ago| since_1970(now.checked_sub(ago)?)) {
        Some(time) => Ok(time),
        None => parse_utc(text).map_err(|error| format!("{error}, or a time ago, e.g. `2h`")),
    }
}

fn since_1970(time: SystemTime) -> Option<u64> {
    u64::try_from(time.duration_since(UNIX_EPOCH).ok()?.as_nanos()).ok()
}

/// How long ago a time was, in the largest unit that gives at least two: `12 s`, `3 min`, `5 h`, `2 d`.
pub fn age(then_unix_ns: u64, now_unix_ns: u64) -> String {
    lasting(now_unix_ns.saturating_sub(then_unix_ns))
}

/// A duration \[ns\] in the same format.
pub fn lasting(ns: u64) -> String {
    let seconds = ns / 1_000_000_000;
    match seconds {
        0..120 => format!("{seconds} s"),
        120..7200 => format!("{} min", seconds / 60),
        7200..172_800 => format!("{} h", seconds / 3600),
        _ => format!("{} d", seconds / 86_400),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_suits_the_age() {
        let of = |seconds: u64| lasting(seconds * 1_000_000_000);
        let ages = [of(0), of(119), of(120), of(7200), of(200_000)];
        assert_eq!(ages, ["0 s", "119 s", "2 min", "2 h", "2 d"]);
        assert_eq!(age(5, 3), "0 s");
    }

    #[test]
    fn times_are_read_as_people_and_fields_write_them() {
        let second = 1_792_540_801_000_000_000;
        for text in ["2026-10-21T00:00:01Z", "2026-10-21T00:00:01", "2026-10-21 00:00:01"] {
            assert_eq!(parse_utc(text), Ok(second), "{text}");
        }
        for text in ["2026-10-21T00:00", "2026-10-21"] {
            assert_eq!(parse_utc(text), Ok(second - 1_000_000_000), "{text}");
        }
        for text in ["yesterday", "1960-01-01T00:00:00Z"] {
            let problem = parse_utc(text).unwrap_err();
            assert!(problem.starts_with(&format!("invalid time `{text}`: expected")), "{problem}");
        }
    }

    #[test]
    fn a_time_may_be_said_as_one_before_now() {
        let now = UNIX_EPOCH + Duration::from_secs(10_000);
        assert_eq!(parse_utc_or_ago("2h 1s", now), Ok(2_799_000_000_000));
        assert_eq!(parse_utc_or_ago("1970-01-01T00:00:01Z", now), Ok(1_000_000_000));
        let problem = parse_utc_or_ago("3h", now).unwrap_err();
        assert!(problem.contains("invalid time `3h`"), "before 1970: {problem}");
    }

    #[test]
    fn times_are_printed_in_utc_whatever_they_are() {
        assert_eq!(utc(0), "1970-01-01T00:00:00.000Z");
        assert_eq!(utc(1_792_540_801_250_999_999), "2026-10-21T00:00:01.250Z");
        assert!(utc(u64::MAX).starts_with("2554-"));
    }
}
