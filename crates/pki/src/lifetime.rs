//! The period of validity of a certificate.

use std::time::SystemTime;

use time::{Duration, OffsetDateTime};

/// A new certificate is backdated by this much, so that clocks that are behind by less accept it at once.
const BACKDATED: Duration = Duration::hours(1);

/// Default validity of an authority's certificate, in days: ten years.
pub const AUTHORITY_DAYS: u16 = 3653;
/// Default validity of a holder's certificate, in days: a key whose loss goes unnoticed is useless after a season.
pub const HOLDER_DAYS: u16 = 90;

/// A warning is due in the last of so many equal parts of a lifetime,
const PARTS: i32 = 4;
/// but not earlier than this before its end.
const SOON: Duration = Duration::days(30);

/// A period of validity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lifetime {
    /// Its beginning.
    pub from: OffsetDateTime,
    /// Its end.
    pub until: OffsetDateTime,
}

/// The present time by this computer's clock.
#[must_use]
pub fn now() -> OffsetDateTime {
    SystemTime::now().into()
}

impl Lifetime {
    /// From slightly before now to this many days from now.
    #[must_use]
    pub fn of_days(days: u16) -> Self {
        let now = now();
        Self { from: now - BACKDATED, until: now + Duration::days(days.into()) }
    }

    /// The remaining time, if a warning is due.
    pub(crate) fn last_part_left(self, now: OffsetDateTime) -> Option<Duration> {
        let left = self.until - now;
        let soon = SOON.min((self.until - self.from) / PARTS);
        (left.is_positive() && left < soon).then_some(left)
    }

    /// The intersection with another period.
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
