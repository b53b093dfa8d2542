//! Limits failed sign-ins per address: after several failures an address gets no answer to further ones for a while.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::time::{Duration, Instant};

use parking_lot::Mutex;

/// Failures answered per address within [`WINDOW`]. Guessing a secret of 256 bits is hopeless; this says so.
const MOST: u32 = 10;
const WINDOW: Duration = Duration::from_secs(60);
/// Addresses that are remembered.
const ADDRESSES: usize = 1024;

/// Failed sign-ins of the last minute.
#[derive(Debug, Default)]
pub(crate) struct Attempts(Mutex<BTreeMap<IpAddr, Failures>>);

#[derive(Debug, Clone, Copy)]
struct Failures {
    first: Instant,
    count: u32,
}

impl Attempts {
    /// Whether this address has failed too often.
    pub(crate) fn is_exhausted(&self, address: IpAddr, now: Instant) -> bool {
        let failures = self.0.lock();
        failures
            .get(&address)
            .is_some_and(|failures| !failures.is_over(now) && failures.count >= MOST)
    }

    /// Records a failure.
    pub(crate) fn failed(&self, address: IpAddr, now: Instant) {
        let mut failures = self.0.lock();
        if failures.len() >= ADDRESSES && !failures.contains_key(&address) {
            failures.retain(|_, failures| !failures.is_over(now));
            if failures.len() >= ADDRESSES {
                failures.pop_first();
            }
        }
        let of_address = failures.entry(address).or_insert(Failures { first: now, count: 0 });
        if of_address.is_over(now) {
            *of_address = Failures { first: now, count: 0 };
        }
        of_address.count = of_address.count.saturating_add(1);
    }
}

impl Failures {
    fn is_over(self, now: Instant) -> bool {
        now.saturating_duration_since(self.first) >= WINDOW
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peer_with_many_failures_waits_a_minute_and_others_do_not() {
        let (attempts, start) = (Attempts::default(), Instant::now());
        let (guest, other) = (IpAddr::from([192, 0, 2, 1]), IpAddr::from([192, 0, 2, 2]));
        for _ in 0..MOST {
            assert!(!attempts.is_exhausted(guest, start));
            attempts.failed(guest, start);
        }
        assert!(attempts.is_exhausted(guest, start));
        assert!(!attempts.is_exhausted(other, start));
        assert!(!attempts.is_exhausted(guest, start + WINDOW));
    }

    #[test]
    fn a_crowd_of_addresses_takes_no_more_memory() {
        let (attempts, start) = (Attempts::default(), Instant::now());
        for number in 0..5000_u32 {
            attempts.failed(IpAddr::from(number.to_be_bytes()), start);
        }
        assert_eq!(attempts.0.lock().len(), ADDRESSES);
    }
}
