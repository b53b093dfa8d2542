//! From when until when a certificate is valid.

use std::time::SystemTime;

use time::{Duration, OffsetDateTime};

/// Clocks that are behind by no more than this take a new certificate at once.
const BACKDATED: Duration = Duration::hours(1);

/// Days that an authority's certificate is valid unless specified otherwise: ten years.
pub const AUTHORITY_DAYS: u16 = 3653;
/// Days that a holder's certificate is valid unless specified otherwise: a lost key that nobody misses is of
/// no use after a season.
pub const HOLDER_DAYS: u16 = 90;

/// The last of so many equal parts of a lifetime is worth a warning,
const PARTS: i32 = 4;
/// but nothing earlier than this before the end.
const SOON: Duration = Duration::days(30);

/// A span of time; a certificate is valid in it and not outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lifetime {
    /// Its first moment.
    pub from: OffsetDateTime,
    /// Its last moment.
    pub until: OffsetDateTime,
}

/// Now, by this computer's clock.
#[must_use]
pub fn now() -> OffsetDateTime {
    SystemTime::now().into()
}

impl Lifetime {
    /// This many days from now, and a little before now.
    #[must_use]
    pub fn of_days(days: u16) -> Self {
        let now = now();
        Self { from: now - BACKDATED, until: now + Duration::days(days.into()) }
    }

    /// How much of it is left, if it is in its last part.
    pub(crate) fn last_part_left(self, now: OffsetDateTime) -> Option<Duration> {
        let left = self.until - now;
        let soon = SOON.min((self.until - self.from) / PARTS);
        (left.is_positive() && left < soon).then_some(left)
    }

    /// The part of it that lies within another one.
    pub(crate) fn within(self, other: Self) -> Self {
        Self { from: self.from.max(other.from), until: self.until.min(other.until) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_warning_comes_in_the_last_part_of_a_lifetime() {
        for (days, soon) in [(8, 2), (HOLDER_DAYS, 22), (397, 30)] {
            let lifetime = Lifetime::of_days(days);
            let left = |left: i64| lifetime.last_part_left(lifetime.until - Duration::hours(left));
            assert_eq!(left(24 * soon - 1), Some(Duration::hours(24 * soon - 1)), "{days}");
            assert_eq!(left(24 * (soon + 1)), None, "{days}");
            assert_eq!(left(-1), None, "{days}");
        }
    }
}
