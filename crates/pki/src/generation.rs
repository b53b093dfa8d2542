//! Which of a holder's certificates: the first, or the one after so many revocations.
//!
//! ```text
//! module1          the first
//! module1~2        the one after a revocation
//! ```
//!
//! Access control knows a certificate by its common name alone. Only a name that the lost certificate has
//! not can therefore do without it; a renewed certificate keeps its generation.

use std::fmt;
use std::num::NonZeroU32;
use std::str::FromStr;

use crate::holder::{Holder, HolderError};

/// Between holder and generation: outside the alphabet of names, and plain in file names and in JSON.
const MARK: char = '~';

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
    fn written(text: &str) -> Option<Self> {
        let read = Self(text.parse().ok()?);
        (read > Self::FIRST && read.0.to_string() == text).then_some(read)
    }
}

/// A holder with the generation of a certificate.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Issued {
    /// Who.
    pub holder: Holder,
    /// By which of the holder's certificates.
    pub generation: Generation,
}

/// By the first certificate.
impl From<Holder> for Issued {
    fn from(holder: Holder) -> Self {
        Self { holder, generation: Generation::FIRST }
    }
}

impl fmt::Display for Issued {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.generation {
            Generation::FIRST => self.holder.fmt(f),
            Generation(number) => write!(f, "{}{MARK}{number}", self.holder),
        }
    }
}

impl FromStr for Issued {
    type Err = HolderError;

    fn from_str(text: &str) -> Result<Self, HolderError> {
        let Some((holder, generation)) = text.split_once(MARK) else {
            return Ok(text.parse::<Holder>()?.into());
        };
        let wrong = || HolderError::Generation(text.chars().take(80).collect());
        let generation = Generation::written(generation).ok_or_else(wrong)?;
        Ok(Self { holder: holder.parse()?, generation })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_generation_is_written_as_it_is_read_and_the_first_is_not_written() {
        for (text, number) in
            [("module1", 1), ("plant~2", 2), ("operator.ada~4294967295", u32::MAX)]
        {
            let issued: Issued = text.parse().unwrap();
            assert_eq!((issued.generation.number(), issued.to_string().as_str()), (number, text));
        }
        assert_eq!(Generation::FIRST.next().number(), 2);
    }

    #[test]
    fn every_generation_is_written_in_one_way() {
        for text in ["a~", "a~0", "a~1", "a~02", "a~+2", "a~-2", "a~2~2", "a~4294967296", "a~two"] {
            let refused = text.parse::<Issued>();
            assert_eq!(refused, Err(HolderError::Generation(text.to_owned())), "{text}");
        }
        assert!(matches!("king.ada~2".parse::<Issued>(), Err(HolderError::Form(_))));
    }
}
