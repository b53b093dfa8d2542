//! From when until when a certificate is valid.

use std::time::SystemTime;

use time::{Duration, OffsetDateTime};

/// Clocks that are behind by no more than this take a new certificate at once.
const BACKDATED: Duration = Duration::hours(1);

/// Days that an authority's certificate is valid unless specified otherwise: ten years.
pub const AUTHORITY_DAYS: u16 = 3653;
/// Days that a holder's certificate is valid unless specified otherwise: a year and a month.
pub const HOLDER_DAYS: u16 = 397;

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

    /// The part of it that lies within another one.
    pub(crate) fn within(self, other: Self) -> Self {
        Self { from: self.from.max(other.from), until: self.until.min(other.until) }
    }
}
