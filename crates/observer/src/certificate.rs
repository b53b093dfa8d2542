//! Certificates that expire soon: the only rule of when that is said.

use vocabulary::words::utc;

/// How long before its end a certificate is said to expire \[s\].
const EXPIRES_SOON_S: u64 = 21 * DAY_S;
const DAY_S: u64 = 24 * 3600;

/// A certificate that a process shows to others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ShownCertificate {
    /// The common name of its holder, e.g. `router.ground.tower`.
    pub name: String,
    /// When it expires \[s since 1970\].
    pub until_unix_s: u64,
}

impl ShownCertificate {
    /// In words, that it expires within 21 days or has expired: "expires in 9 days (…)". A process that is connected
    /// goes on until it has to connect again.
    #[must_use]
    pub fn expiring(&self, now_unix_s: u64) -> Option<String> {
        let left = self.until_unix_s.saturating_sub(now_unix_s);
        if left > EXPIRES_SOON_S {
            return None;
        }
        let at = utc(self.until_unix_s.saturating_mul(1_000_000_000));
        Some(match left / DAY_S {
            0 if left == 0 => format!("has expired ({at})"),
            0 => format!("expires within a day ({at})"),
            1 => format!("expires in a day ({at})"),
            days => format!("expires in {days} days ({at})"),
        })
    }
}
