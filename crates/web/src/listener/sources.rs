//! Where requests come from, and how many connections each source has.

use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv6Addr, SocketAddr};
use std::sync::Arc;

use axum::http::HeaderMap;
use parking_lot::Mutex;

/// The header by which a proxy names its client.
const FORWARDED: &str = "x-forwarded-for";
/// A client of IPv6 commands all addresses of a network, of which these bits are the same.
const NETWORK: u128 = !0 << 64;

/// What is counted as one source: an address of IPv4, or a network of IPv6.
pub(crate) fn source(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(address) => IpAddr::V6(Ipv6Addr::from_bits(address.to_bits() & NETWORK)),
        address @ IpAddr::V4(_) => address,
    }
}

/// The client that the proxy names: the last address in the header. The proxy appended it; the client itself may have
/// sent those before.
pub(super) fn forwarded(headers: &HeaderMap) -> Option<IpAddr> {
    let last = headers.get_all(FORWARDED).iter().next_back()?.to_str().ok()?;
    let last = last.rsplit(',').next()?.trim();
    let bare = last.strip_prefix('[').and_then(|last| last.strip_suffix(']')).unwrap_or(last);
    bare.parse().ok().or_else(|| last.parse::<SocketAddr>().ok().map(|address| address.ip()))
}

/// The number of open connections of each source.
#[derive(Debug, Default)]
pub(super) struct Sources(Mutex<BTreeMap<IpAddr, usize>>);

/// The place of a connection, given back when dropped.
#[derive(Debug)]
pub(super) struct SourcePlace {
    sources: Arc<Sources>,
    source: IpAddr,
}

impl Sources {
    /// A place, unless this source has `most` already.
    pub(super) fn enter(self: &Arc<Self>, source: IpAddr, most: usize) -> Option<SourcePlace> {
        let mut open = self.0.lock();
        let of_source = open.entry(source).or_default();
        if *of_source >= most {
            return None;
        }
        *of_source += 1;
        Some(SourcePlace { sources: Arc::clone(self), source })
    }
}

impl Drop for SourcePlace {
    fn drop(&mut self) {
        let mut open = self.sources.0.lock();
        if let Some(of_source) = open.get_mut(&self.source) {
            *of_source = of_source.saturating_sub(1);
            if *of_source == 0 {
                open.remove(&self.source);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::{HeaderName, HeaderValue};

    #[test]
    fn the_client_is_the_address_that_the_proxy_appended() {
        let client = |lines: &[&'static str]| {
            let pair = |line: &&'static str| {
                (HeaderName::from_static(FORWARDED), HeaderValue::from_static(line))
            };
            let found = forwarded(&lines.iter().map(pair).collect());
            found.map(|address| address.to_string()).unwrap_or_default()
        };
        assert_eq!(client(&["198.51.100.5"]), "198.51.100.5");
        assert_eq!(client(&["203.0.113.66, 10.0.0.1,198.51.100.5"]), "198.51.100.5");
        assert_eq!(client(&["203.0.113.66", "198.51.100.5"]), "198.51.100.5");
        assert_eq!(client(&["198.51.100.5:4711"]), "198.51.100.5");
        assert_eq!(client(&["[2001:db8::1]:4711"]), "2001:db8::1");
        assert_eq!(client(&["[2001:db8::1]"]), "2001:db8::1");
        // Never an earlier one in place of one that is not usable.
        for line in ["203.0.113.66, unknown", "203.0.113.66,", "", "a"] {
            assert_eq!(client(&[line]), "", "{line}");
        }
        assert_eq!(client(&[]), "");
    }

    #[test]
    fn a_source_is_an_address_or_a_network_of_ipv6() {
        let of = |text: &str| source(text.parse().unwrap()).to_string();
        assert_eq!(of("198.51.100.5"), "198.51.100.5");
        assert_eq!(of("::ffff:198.51.100.5"), "198.51.100.5");
        assert_eq!(of("2001:db8:0:1:2:3:4:5"), of("2001:db8:0:1::9"));
        assert_ne!(of("2001:db8:0:1::1"), of("2001:db8:0:2::1"));
    }

    #[test]
    fn a_place_is_free_again_when_its_connection_has_ended() {
        let (sources, one) = (Arc::new(Sources::default()), IpAddr::from([192, 0, 2, 1]));
        let first = sources.enter(one, 2).unwrap();
        let second = sources.enter(one, 2).unwrap();
        assert!(sources.enter(one, 2).is_none());
        assert!(sources.enter(IpAddr::from([192, 0, 2, 2]), 2).is_some());
        drop(first);
        let third = sources.enter(one, 2);
        assert!(third.is_some());
        drop((third, second));
        assert!(sources.0.lock().is_empty());
    }
}
