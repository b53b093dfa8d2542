//! The period of validity of a certificate.

use std::time::SystemTime;

use time::{Duration, OffsetDateTime};

/// A new certificate is backdated by this much, so that clocks that are behind by less accept it at once.
const BACKDATED: Duration = Duration::hours(1);

/// Default validity of an authority's certificate, in days: ten years.
pub const AUTHORITY_DAYS: u16 = 3653;
/// Default validity of a holder's certificate, in days: a key whose loss goes unnoticed is useless after a season.
pub const HOLDER_DAYS: u16 = 90;

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

    /// The intersection with another period.
    pub(crate) fn within(self, other: Self) -> Self {
        Self { from: self.from.max(other.from), until: self.until.min(other.until) }
    }
}
