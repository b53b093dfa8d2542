//! Requests that were refused, logged: each kind at once, and from then on once a minute.

use std::net::IpAddr;
use std::time::Instant;

use shell::occurrences::Occurrences;

/// Why a request is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RefusedAccess {
    /// A method that no page has.
    Method,
    /// Reached under a foreign name.
    Host,
    /// A form of a foreign page.
    Origin,
    /// An unknown or malformed form, or one that is too long.
    Form,
    /// A form without the token of the session.
    Token,
    /// Not signed in, or not permitted.
    Permission,
    /// An invalid link or certificate.
    SignIn,
}

/// How often each happened.
#[derive(Debug, Default)]
pub(crate) struct AccessRefusals([Occurrences; 7]);

impl AccessRefusals {
    /// Notes one, from this address.
    pub(crate) fn note(&self, refused: RefusedAccess, from: IpAddr, words: &str) {
        let occurrences = self.0.get(refused as usize);
        if let Some(times) = occurrences.and_then(|occurrences| occurrences.note(Instant::now())) {
            let words = vocabulary::printable(words);
            tracing::warn!(%from, times, "a request was refused: {words}");
        }
    }
}
