//! Zenoh's settings for a process that enforces access control: mutual TLS, explicit endpoints, fast detection of
//! losses.

use std::io::Write;
use std::path::{Path, PathBuf};

use pki::holder::BearerName;
use pki::{Generations, Holder, Identity, Library};
use serde_json::{Value, json};
use session::{
    ACCEPTING_MS, DEFAULT_LEASE_MS, LEASES_MS, LONGEST_MESSAGE_BYTES, OPENING_MS, endpoint,
    wait_before_close_us,
};

use super::parties::People;
use crate::failure::Failure;
use crate::output;

/// Endpoints, permitted users and lease of the process that enforces access control.
#[derive(Debug, clap::Args)]
pub(super) struct Common {
    /// Endpoint to listen on, e.g. `tls/192.0.2.10:7447`; may be repeated [default: an endpoint on the loopback
    /// interface]
    #[arg(long, value_name = "ENDPOINT")]
    listen: Vec<String>,
    /// An operator, who may issue commands; may be repeated
    #[arg(long = "operator", value_name = "NAME")]
    operators: Vec<BearerName>,
    /// An observer, who may only read; may be repeated
    #[arg(long = "observer", value_name = "NAME")]
    observers: Vec<BearerName>,
    /// A link without a message for this time is closed [ms]; use more than the default for long or lossy links
    #[arg(long, value_name = "MS", default_value_t = DEFAULT_LEASE_MS, value_parser = lease_ms)]
    lease_ms: u32,
    /// Directory of certificates; adds its operators and observers, and denies revoked certificates. Without it, only the
    /// first certificate of each holder is accepted
    #[arg(long = "dir", value_name = "DIRECTORY")]
    directory: Option<PathBuf>,
}

impl Common {
    /// Prints the settings of a router, to which all others connect; the router connects to `connect`, if given.
    pub(super) fn print_router(
        &self,
        heading: &str,
        access: Value,
        connect: Option<&str>,
    ) -> Result<(), Failure> {
        let mut settings = self.settings("router", "tls/127.0.0.1:7447", access, connect);
        settings["transport"]["unicast"]["max_sessions"] = 2000.into();
        print(heading, &settings)
    }

    /// Prints the settings of a peer, which connects to all other peers.
    pub(super) fn print_peer(&self, heading: &str, access: Value) -> Result<(), Failure> {
        let connect = Some("tls/127.0.0.1:7447");
        print(heading, &self.settings("peer", "tls/127.0.0.1:7448", access, connect))
    }

    /// Settings not listed here have Zenoh's defaults; the timeouts equal those of all other sessions. Without
    /// endpoints the process listens on `otherwise`, which exists on every computer.
    fn settings(&self, mode: &str, otherwise: &str, access: Value, connect: Option<&str>) -> Value {
        let otherwise = [otherwise.to_owned()];
        let listen = if self.listen.is_empty() { &otherwise[..] } else { &self.listen };
        let wait_before_close = wait_before_close_us(self.lease_ms);
        let mut settings = json!({
            "mode": mode,
            "listen": { "endpoints": listen, "timeout_ms": 0, "exit_on_failure": true },
            "scouting": { "multicast": { "enabled": false }, "gossip": { "enabled": false } },
            "transport": {
                "unicast": { "open_timeout": OPENING_MS, "accept_timeout": ACCEPTING_MS },
                "link": {
                    "protocols": ["tls"],
                    "rx": { "max_message_size": LONGEST_MESSAGE_BYTES },
                    "tx": {
                        "lease": self.lease_ms,
                        "queue": {
                            "congestion_control": {
                                "block": { "wait_before_close": wait_before_close },
                            },
                        },
                    },
                    "tls": {
                        "enable_mtls": true,
                        "verify_name_on_connect": true,
                        "close_link_on_expiration": true,
                    },
                },
            },
            "access_control": access,
        });
        if let Some(place) = connect {
            // Reconnects whenever the link is lost.
            settings["connect"] = json!({
                "endpoints": [place],
                "timeout_ms": -1,
                "exit_on_failure": false,
                "retry": {
                    "period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 1.5,
                },
            });
        }
        settings
    }

    /// Requires TLS endpoints, because only TLS transmits certificates.
    pub(super) fn check_endpoints(&self) -> Result<(), Failure> {
        check_endpoints(&self.listen)
    }

    /// The users named in the arguments, and those in the directory.
    pub(super) fn people(&self) -> Result<People, Failure> {
        let mut people = People {
            operators: self.operators.iter().cloned().collect(),
            observers: self.observers.iter().cloned().collect(),
            generations: Generations::default(),
            ..People::default()
        };
        let Some(directory) = &self.directory else { return Ok(people) };
        let library = Library::at(directory);
        let read = || Ok((library.holders()?, library.generations()?));
        let (holders, generations) =
            read().map_err(|error: std::io::Error| Failure::unreadable(directory, error))?;
        people.generations = generations;
        for holder in holders {
            match holder {
                Holder::Operator(name) => drop(people.operators.insert(name)),
                Holder::Observer(name) => drop(people.observers.insert(name)),
                Holder::Module(_) | Holder::Plant | Holder::Router(_) => {}
            }
        }
        Ok(people)
    }
}

/// Parses a lease \[ms\].
fn lease_ms(text: &str) -> Result<u32, String> {
    let lease_ms = text.parse().ok().filter(|lease_ms| LEASES_MS.contains(lease_ms));
    lease_ms.ok_or_else(|| format!("use {} to {} ms", LEASES_MS.start(), LEASES_MS.end()))
}

fn check_endpoints(endpoints: &[String]) -> Result<(), Failure> {
    let is_tls = |text: &str| endpoint(text).is_ok_and(|read| read.protocol().as_str() == "tls");
    match endpoints.iter().find(|text| !is_tls(text)) {
        Some(text) => Err(Failure::input(format!(
            "invalid TLS endpoint `{text}`; write e.g. `tls/192.0.2.10:7447`"
        ))),
        None => Ok(()),
    }
}

/// Prints the settings as JSON, which is valid JSON5, below a header of comments.
fn print(heading: &str, settings: &Value) -> Result<(), Failure> {
    let mut out = output::stdout();
    writeln!(out, "{heading}")?;
    serde_json::to_writer_pretty(&mut out, settings)?;
    writeln!(out)?;
    Ok(out.flush()?)
}

/// The endpoint of a fleet's router in Zenoh's syntax: only on this link the gateway trusts the fleet's authority and
/// shows the fleet's certificate; on all others it trusts the structure's authority.
pub(super) fn gateway_endpoint(place: &str, directory: &Path) -> Result<String, Failure> {
    check_endpoints(&[place.to_owned()])?;
    let identity = Identity::in_directory(directory);
    let files = [
        ("root_ca_certificate_file", &identity.authority),
        ("connect_certificate_file", &identity.certificate),
        ("connect_private_key_file", &identity.key),
    ];
    let named = files.map(|(key, file)| format!("{key}={}", file.display())).join(";");
    // Zenoh interprets these characters as the end of a name.
    if place.contains('#') || named.contains('#') || named.matches(';').count() >= files.len() {
        let directory = directory.display();
        return Err(Failure::usage(format!(
            "`{place}`, `{directory}`: an endpoint and a directory of certificates must not contain `#` or `;`"
        )));
    }
    Ok(format!("{place}#{named}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_this_link_is_made_with_the_fleets_certificate() {
        let read = gateway_endpoint("tls/192.0.2.99:7447", Path::new("/etc/fleet")).unwrap();
        let expected = "tls/192.0.2.99:7447#root_ca_certificate_file=/etc/fleet/authority.pem;\
                        connect_certificate_file=/etc/fleet/certificate.pem;\
                        connect_private_key_file=/etc/fleet/key.pem";
        assert_eq!(read, expected);
        assert!(session::endpoint(&read).is_ok());
        for (place, directory) in
            [("tcp/192.0.2.99:7447", "/etc"), ("tls/a:1#b=c", "/etc"), ("tls/a:1", "/etc/a;b")]
        {
            assert!(gateway_endpoint(place, Path::new(directory)).is_err(), "{place} {directory}");
        }
    }
}
