//! Unguessable random texts for sessions, forms and one-time links.

use std::fmt;

use ring::digest::{SHA256, digest};
use ring::rand::{SecureRandom, SystemRandom};

/// Length in bytes: 256 bits.
const BYTES: usize = 32;

/// A random text of 64 hexadecimal digits. Its `Debug` output hides it, so it does not reach logs.
#[derive(Clone)]
pub(crate) struct Secret(String);

/// The SHA-256 digest of a secret, stored in its place because it cannot be inverted. Comparing digests rather than
/// secrets also makes the duration of a comparison reveal nothing about the secret.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Fingerprint(String);

/// The system's random number generator failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("system random number generator failed")]
pub struct NoRandomness;

impl Secret {
    pub(crate) fn new() -> Result<Self, NoRandomness> {
        let mut bytes = [0; BYTES];
        SystemRandom::new().fill(&mut bytes).map_err(|_| NoRandomness)?;
        Ok(Self(hexadecimal(&bytes)))
    }

    /// Parses a text in the form of a secret.
    pub(crate) fn from_text(text: &str) -> Option<Self> {
        let is_digit = |byte: u8| matches!(byte, b'0'..=b'9' | b'a'..=b'f');
        let has_form = text.len() == 2 * BYTES && text.bytes().all(is_digit);
        has_form.then(|| Self(text.to_owned()))
    }

    pub(crate) fn as_str(&self) -> &str {
        &self.0
    }

    pub(crate) fn fingerprint(&self) -> Fingerprint {
        Fingerprint(hexadecimal(digest(&SHA256, self.0.as_bytes()).as_ref()))
    }
}

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Secret(..)")
    }
}

impl Fingerprint {
    /// The digest as a file name.
    pub(crate) fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Debug for Fingerprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Fingerprint({})", self.0)
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn secrets_differ_and_are_read_back_and_never_shown() {
        let (one, other) = (Secret::new().unwrap(), Secret::new().unwrap());
        assert_ne!(one.as_str(), other.as_str());
        assert_ne!(one.fingerprint(), other.fingerprint());
        let read = Secret::from_text(one.as_str()).unwrap();
        assert_eq!(read.fingerprint(), one.fingerprint());
        assert_eq!(format!("{one:?}"), "Secret(..)");
        for text in ["", "../../etc/passwd", &"A".repeat(64), &"é".repeat(32), &"a".repeat(65)] {
            assert!(Secret::from_text(text).is_none(), "{text}");
        }
    }

    #[test]
    fn the_fingerprint_is_the_sha256_of_the_text() {
        // By `printf 0…0 | sha256sum`, with 64 zeros.
        let zeros = Secret::from_text(&"0".repeat(64)).unwrap();
        let expected = "60e05bd1b195af2f94112fa7197a5c88289058840ce7c6df9693756bc6250f55";
        assert_eq!(zeros.fingerprint().as_str(), expected);
    }
}
