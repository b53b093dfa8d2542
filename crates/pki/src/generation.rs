//! Which of a holder's certificates: the first, or the one after so many revocations.
//!
//! ```text
//! module1          the first
//! module1~2        the one after a revocation
//! ```
//!
//! Access control knows a certificate by its common name alone. Only a name that the lost certificate has
//! not can therefore do without it; a renewed certificate keeps its generation.

use std::num::NonZeroU32;

/// Between holder and generation: outside the alphabet of names, and plain in file names and in JSON.
pub(crate) const MARK: char = '~';

/// How many certificates with other names a holder has had, with this one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Generation(NonZeroU32);

impl Generation {
    /// That of a holder of whom nothing was revoked; it is not written.
    pub const FIRST: Self = Self(NonZeroU32::MIN);

    /// The one after it is revoked.
    #[must_use]
    pub fn next(self) -> Self {
        Self(self.0.saturating_add(1))
    }

    /// As a number, from 1.
    #[must_use]
    pub fn number(self) -> u32 {
        self.0.get()
    }

    /// As it is written behind the mark, in one way only.
    pub(crate) fn written(text: &str) -> Option<Self> {
        let read = Self(text.parse().ok()?);
        (read > Self::FIRST && read.0.to_string() == text).then_some(read)
    }
}
