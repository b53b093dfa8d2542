//! Logs refused requests: each kind at once, then at most once a minute.

use std::net::IpAddr;
use std::time::Instant;

use vocabulary::Occurrences;

/// Why a request is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RefusedAccess {
    /// A method that no page supports.
    Method,
    /// A request under a name that is not this site's.
    Host,
    /// A form from another site.
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

/// Counts refusals by reason.
#[derive(Debug, Default)]
pub(crate) struct AccessRefusals([Occurrences; 7]);

impl AccessRefusals {
    /// Records a refusal of a request from this address.
    pub(crate) fn note(&self, refused: RefusedAccess, from: IpAddr, words: &str) {
        let occurrences = self.0.get(refused as usize);
        if let Some(times) = occurrences.and_then(|occurrences| occurrences.note(Instant::now())) {
            let words = vocabulary::printable(words);
            tracing::warn!(%from, times, "a request was refused: {words}");
        }
    }
}
