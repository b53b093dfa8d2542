//! The addresses in a certificate, by which a client verifies that it has reached the right computer.

use std::fmt;
use std::net::IpAddr;
use std::str::FromStr;

use rustls::pki_types::DnsName;

/// An IP address or a DNS name, without a port.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Address {
    /// An IP address.
    Ip(IpAddr),
    /// A DNS name in lower case.
    Name(String),
}

/// An invalid address.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("invalid address `{0}`: expected an IP address or a DNS name without a port")]
pub struct AddressError(String);

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Address::Ip(ip) => ip.fmt(f),
            Address::Name(name) => f.write_str(name),
        }
    }
}

impl FromStr for Address {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        if let Ok(ip) = text.parse() {
            return Ok(Address::Ip(ip));
        }
        match DnsName::try_from(text) {
            Ok(name) => Ok(Address::Name(name.as_ref().to_ascii_lowercase())),
            Err(_) => Err(AddressError(text.chars().take(80).collect())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ip_addresses_and_names_are_distinguished_from_the_rest() {
        let parse = |text: &str| text.parse::<Address>();
        assert!(matches!(parse("192.0.2.7"), Ok(Address::Ip(_))));
        assert!(matches!(parse("2001:db8::1"), Ok(Address::Ip(_))));
        assert_eq!(parse("Mast.Example"), Ok(Address::Name("mast.example".into())));
        for text in ["", "192.0.2.7:7447", "a b", "*.example", "tls/mast"] {
            assert!(parse(text).is_err(), "{text}");
        }
    }
}
