//! Which facility this machine lacks.

use std::fmt;
use std::path::Path;

use super::program;

/// A facility that a laboratory needs and that is not available.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("not available: {facility}: {reason}; run as root with /dev/net/tun and iproute2")]
pub struct Missing {
    facility: &'static str,
    reason: String,
}

impl Missing {
    pub(super) fn new(facility: &'static str, reason: impl fmt::Display) -> Self {
        Self { facility, reason: reason.to_string() }
    }

    /// For `map_err` on what the system refused.
    pub(super) fn io(facility: &'static str) -> impl Fn(std::io::Error) -> Self {
        move |error| Self::new(facility, error)
    }

    /// The missing facility.
    #[must_use]
    pub fn facility(&self) -> &'static str {
        self.facility
    }
}

/// What can be checked before anything is tried.
pub(super) fn check() -> Result<(), Missing> {
    program::ip(&["-V"]).map_err(|reason| Missing::new("the program `ip`", reason))?;
    if !Path::new("/dev/net/tun").exists() {
        return Err(Missing::new("/dev/net/tun", "no such file"));
    }
    if !may_administer_networks() {
        let reason = "this process does not have both";
        return Err(Missing::new("CAP_NET_ADMIN and CAP_SYS_ADMIN", reason));
    }
    Ok(())
}

/// Bit 12 of the effective capabilities, and bit 21: a namespace's name is a mount, which takes
/// CAP_SYS_ADMIN.
fn may_administer_networks() -> bool {
    const NEEDED: u64 = 1 << 12 | 1 << 21;
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let effective = status.lines().find_map(|line| line.strip_prefix("CapEff:"));
    let bits = effective.and_then(|hex| u64::from_str_radix(hex.trim(), 16).ok());
    bits.is_some_and(|bits| bits & NEEDED == NEEDED)
}
