//! Endpoints to listen on and connect to: the table `[network]` and its flags.

use std::net::{Ipv4Addr, Ipv6Addr};
use std::ops::RangeInclusive;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use settings::{ConfigErrors, SettingsFile};
use zenoh::config::EndPoint;

use crate::zenoh_file;

/// Connects to its neighbours as a peer, or to a router as a client.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// Connects to one diagnoser or router, which forwards all messages
    Client,
    /// Connects directly to every configured endpoint
    #[default]
    Peer,
}

/// The table `[network]`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Network {
    /// Peer, the default, or client.
    pub mode: Option<Mode>,
    /// Endpoints to listen on, e.g. `tcp/127.0.0.1:7447`; added to by `--listen`.
    pub listen: Vec<String>,
    /// Endpoints to connect to; added to by `--connect`.
    pub connect: Vec<String>,
    /// A file of Zenoh settings in JSON5, which replaces the settings of trusswatch; only `listen` and `connect`, if given,
    /// override the file, and messages are limited to [`crate::LONGEST_MESSAGE_BYTES`] unless the file sets a limit.
    pub zenoh: Option<PathBuf>,
    /// A directory with this process's certificate, its key and the authority's certificate, as
    /// `trusswatch pki issue` makes it; overridden by `--tls`. Every link then uses mutually
    /// authenticated TLS, and other links are refused.
    pub tls: Option<PathBuf>,
    /// A link without a received message for this time is closed \[ms\], as is one on which a message cannot be sent for a
    /// fifth of it. The default is [`DEFAULT_LEASE_MS`]; long or lossy links need more.
    pub lease_ms: Option<u32>,
}

/// Detects a loss quickly on the network of one site \[ms\].
pub const DEFAULT_LEASE_MS: u32 = 1000;
/// Permitted leases \[ms\].
pub const LEASES_MS: RangeInclusive<u32> = 200..=60_000;

impl Network {
    /// A peer that does not listen.
    #[must_use]
    pub fn peer_of(endpoints: &[String]) -> Self {
        Self { connect: endpoints.to_vec(), ..Self::default() }
    }

    /// The lease of its links \[ms\].
    #[must_use]
    pub fn lease_ms(&self) -> u32 {
        self.lease_ms.unwrap_or(DEFAULT_LEASE_MS)
    }

    /// Adds endpoints and certificate from the command line.
    pub fn add(&mut self, flags: &NetworkFlags) {
        self.listen.extend_from_slice(&flags.listen);
        self.connect.extend_from_slice(&flags.connect);
        self.tls = flags.tls.clone().or(self.tls.take());
    }

    /// Resolves paths relative to the settings file, and checks all settings.
    pub fn check(&mut self, document: &SettingsFile, errors: &mut ConfigErrors) {
        let line = |key: &str| document.line(&["network", key]);
        let wrong = self.listen.iter().filter_map(|text| endpoint(text).err());
        wrong.for_each(|error| errors.add(&document.file, line("listen"), error));
        let wrong = self.connect.iter().filter_map(|text| to_connect(text).err());
        wrong.for_each(|error| errors.add(&document.file, line("connect"), error));
        if let Some(lease_ms) = self.lease_ms.filter(|lease_ms| !LEASES_MS.contains(lease_ms)) {
            let (least, most) = (LEASES_MS.start(), LEASES_MS.end());
            let problem = format!("a lease of {lease_ms} ms; use {least} to {most} ms");
            errors.add(&document.file, line("lease_ms"), problem);
        }
        if let Some(directory) = &mut self.tls {
            *directory = document.beside(directory);
        }
        let Some(file) = &mut self.zenoh else { return };
        *file = document.beside(file);
        for (key, is_set) in [("mode", self.mode.is_some()), ("lease_ms", self.lease_ms.is_some())]
        {
            if is_set {
                let problem = format!("`{key}` has no effect beside `zenoh`; set it in that file");
                errors.add(&document.file, line(key), problem);
            }
        }
        if let Err(error) = zenoh_file::from_file(file) {
            errors.add(&document.file, line("zenoh"), error);
        }
    }
}

/// Endpoints from the command line.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct NetworkFlags {
    /// Listen on this endpoint too, e.g. `tcp/127.0.0.1:7447`; may be repeated
    #[arg(long, value_name = "ENDPOINT", value_parser = to_listen)]
    pub listen: Vec<String>,
    /// Connect to this endpoint too; may be repeated
    #[arg(long, value_name = "ENDPOINT", value_parser = to_connect)]
    pub connect: Vec<String>,
    /// Authenticate with the certificate in this directory, made by `trusswatch pki issue`, and
    /// accept nothing but mutually authenticated TLS
    #[arg(long, value_name = "DIRECTORY")]
    pub tls: Option<PathBuf>,
}

fn to_listen(text: &str) -> Result<String, EndpointError> {
    endpoint(text).map(|_| text.to_owned())
}

/// The protocols that this build of Zenoh supports.
const PROTOCOLS: [&str; 3] = ["tcp", "tls", "unixsock-stream"];

/// An invalid endpoint.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EndpointError {
    /// The text does not have the form of an endpoint.
    #[error("`{text}` is not a valid endpoint; write e.g. `tcp/127.0.0.1:7447`")]
    Form {
        /// The text.
        text: String,
    },
    /// An address that no process can have.
    #[error(
        "`{text}` is not a valid endpoint: {problem}; write e.g. `tcp/127.0.0.1:7447` or `tcp/[::1]:7447`"
    )]
    Address {
        /// The text.
        text: String,
        /// What is wrong with its address.
        problem: &'static str,
    },
    /// An unsupported protocol.
    #[error("`{text}` is an endpoint of no known protocol; use {}", PROTOCOLS.join(", "))]
    Protocol {
        /// The text.
        text: String,
    },
}

/// Parses an endpoint, e.g. `tcp/127.0.0.1:7447`.
///
/// # Errors
/// The text does not have that form, or the protocol is not supported.
pub fn endpoint(text: &str) -> Result<EndPoint, EndpointError> {
    let endpoint: EndPoint =
        text.parse().map_err(|_| EndpointError::Form { text: text.to_owned() })?;
    let protocol = endpoint.protocol();
    if !PROTOCOLS.contains(&protocol.as_str()) {
        return Err(EndpointError::Protocol { text: text.to_owned() });
    }
    let address = endpoint.address();
    let checked = match protocol.as_str() {
        "tcp" | "tls" => host_and_port(address.as_str()),
        _ => Ok(()),
    };
    checked.map_err(|problem| EndpointError::Address { text: text.to_owned(), problem })?;
    Ok(endpoint)
}

/// Checks an endpoint to connect to.
fn to_connect(text: &str) -> Result<String, EndpointError> {
    if endpoint(text)?.address().as_str().ends_with(":0") {
        let problem = "nothing listens on port 0; use the port on which the other process listens";
        return Err(EndpointError::Address { text: text.to_owned(), problem });
    }
    Ok(text.to_owned())
}

/// Longest name of a host (RFC 1035, section 2.3.4).
const LONGEST_HOST: usize = 253;

/// Checks an address of TCP: `HOST:PORT`, with an IPv6 address in brackets. Zenoh would retry forever what it
/// cannot parse or resolve, without a word.
fn host_and_port(address: &str) -> Result<(), &'static str> {
    if address.contains([',', ';']) {
        return Err("write each endpoint by itself");
    }
    let no_port = "it has no port";
    let (host, port) = address.rsplit_once(':').ok_or(no_port)?;
    if address.starts_with('[') && port.ends_with(']') {
        return Err(no_port);
    }
    if let Some(bracketed) = host.strip_prefix('[') {
        let ip = bracketed.strip_suffix(']').ok_or("the bracket of its host is not closed")?;
        ip.parse::<Ipv6Addr>().map_err(|_| "the host in brackets is not an IPv6 address")?;
    } else if host.contains(':') {
        return Err("an IPv6 address must be in brackets");
    } else if host.is_empty() || host.len() > LONGEST_HOST {
        return Err("its host must have 1 to 253 characters");
    } else if !host.strip_suffix('.').unwrap_or(host).split('.').all(is_label) {
        return Err("its host is neither an address nor a name");
    } else if host.chars().all(|c| c.is_ascii_digit() || c == '.')
        && host.parse::<Ipv4Addr>().is_err()
    {
        return Err("its host is not an IPv4 address");
    }
    let is_number = port.bytes().all(|byte| byte.is_ascii_digit());
    let port = port.parse::<u16>().ok().filter(|_| is_number);
    port.map(|_| ()).ok_or("its port must be a number from 1 to 65535")
}

/// A part of a name (RFC 952; underscores are common).
fn is_label(label: &str) -> bool {
    let has_ends = !label.is_empty() && !label.starts_with('-') && !label.ends_with('-');
    has_ends && label.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c))
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[test]
    fn only_what_can_be_opened_is_an_endpoint() {
        for text in ["tcp/127.0.0.1:7447", "tls/[::1]:0", "unixsock-stream/run/structure.sock"] {
            assert!(endpoint(text).is_ok_and(|read| read.as_str() == text), "{text}");
        }
        for text in ["", "nowhere", "tcp/", "/127.0.0.1:7447"] {
            let error = endpoint(text).unwrap_err().to_string();
            assert!(
                error.ends_with("is not a valid endpoint; write e.g. `tcp/127.0.0.1:7447`"),
                "{error}"
            );
        }
        for (text, problem) in [
            ("tcp/127.0.0.1", "it has no port"),
            ("tcp/[::1]", "it has no port"),
            ("tls/[2001:db8::7]", "it has no port"),
            ("tcp/[::1]:", "its port must be a number from 1 to 65535"),
            ("tcp/127.0.0.1:", "its port must be a number from 1 to 65535"),
            ("tcp/127.0.0.1:70000", "its port must be a number from 1 to 65535"),
            ("tcp/127.0.0.1:+7447", "its port must be a number from 1 to 65535"),
            ("tcp/127.0.0.1:7447 ", "its port must be a number from 1 to 65535"),
            ("tcp/ 127.0.0.1:7447", "its host is neither an address nor a name"),
            ("tcp/*:7447", "its host is neither an address nor a name"),
            ("tcp/a..b:7447", "its host is neither an address nor a name"),
            ("tcp/-a:7447", "its host is neither an address nor a name"),
            ("tcp/a:7447,tcp/b:7447", "write each endpoint by itself"),
            ("tcp/300.0.0.1:7447", "its host is not an IPv4 address"),
            ("tcp/127.1:7447", "its host is not an IPv4 address"),
            ("tcp/:7447", "its host must have 1 to 253 characters"),
            ("tcp/fe80::1:7447", "an IPv6 address must be in brackets"),
            ("tcp/[fe80::1:7447", "the bracket of its host is not closed"),
            ("tls/[fe80::1%eth0]:7447", "the host in brackets is not an IPv6 address"),
        ] {
            let right = "write e.g. `tcp/127.0.0.1:7447` or `tcp/[::1]:7447`";
            let expected = format!("`{text}` is not a valid endpoint: {problem}; {right}");
            assert_eq!(endpoint(text).unwrap_err().to_string(), expected);
        }
        assert!(endpoint(&format!("tcp/{}:1", "a".repeat(254))).is_err());
        for text in ["tcp/module-1.tower.example:7447", "tls/0.0.0.0:7447#iface=eth0", "tcp/a_b:0"]
        {
            assert!(endpoint(text).is_ok(), "{text}");
        }
        assert_eq!(
            endpoint("tpc/127.0.0.1:7447").unwrap_err().to_string(),
            "`tpc/127.0.0.1:7447` is an endpoint of no known protocol; use tcp, tls, unixsock-stream"
        );
    }

    #[derive(Debug, Parser)]
    struct Program {
        #[command(flatten)]
        network: NetworkFlags,
    }

    #[test]
    fn a_flag_that_is_no_endpoint_is_named() {
        for (flag, text, wrong) in [
            ("--listen", "nowhere", "`nowhere` is not a valid endpoint"),
            ("--connect", "tpc/host:7447", "`tpc/host:7447` is an endpoint of no known protocol"),
        ] {
            let error = Program::try_parse_from(["p", flag, text]).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            let error = error.to_string();
            assert!(error.contains(flag) && error.contains(wrong), "{error}");
        }
        let error = Program::try_parse_from(["p", "--connect", "tcp/a:0"]).unwrap_err().to_string();
        assert!(error.contains("nothing listens on port 0"), "{error}");
        Program::try_parse_from(["p", "--listen", "tcp/a.example.:0"]).unwrap();
        let read = Program::try_parse_from(["p", "--listen", "tcp/127.0.0.1:7447"]).unwrap();
        assert_eq!(read.network.listen, ["tcp/127.0.0.1:7447"]);
    }
}
