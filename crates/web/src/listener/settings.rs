//! Addresses and protocol of the web page.

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;

use super::site::{PageAddress, Site};

/// Addresses and protocol of the web page.
#[derive(Debug, Clone)]
pub struct ListenerSettings {
    /// The addresses to listen on.
    pub listen: Vec<SocketAddr>,
    /// The files for TLS; plain HTTP without them.
    pub tls: Option<TlsFiles>,
    /// The origin of a reverse proxy that terminates TLS.
    pub behind_proxy: Option<PageAddress>,
    /// Additional names of the site: NAME, or NAME:PORT for another port.
    pub names: Vec<String>,
}

/// Files for TLS, in PEM format.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TlsFiles {
    /// The server certificate.
    pub certificate: PathBuf,
    /// Its private key.
    pub key: PathBuf,
    /// The authority whose certificates users may sign in with; without it the server requests no client certificate.
    pub authority: Option<PathBuf>,
}

/// Why the page cannot be served.
#[derive(Debug, thiserror::Error)]
pub enum ListenError {
    /// The list of addresses is empty.
    #[error("no address to listen on; 127.0.0.1:8480 is one")]
    Nowhere,
    /// Plain HTTP on the network would let anyone read pages and take over sessions.
    #[error(
        "{0} can be reached from other computers, over plain HTTP; give a certificate and its key, or listen on \
         127.0.0.1 behind a proxy that does TLS, or name that proxy's address, https://NAME"
    )]
    Plain(SocketAddr),
    /// Both the proxy and this process would do TLS.
    #[error("a proxy does TLS, and so does this; use one of them")]
    Both,
    /// The address is in use or does not belong to this machine.
    #[error(
        "the page cannot be served on {address}: {error}; free the port or choose another address"
    )]
    Address {
        /// The address.
        address: SocketAddr,
        /// The cause.
        error: io::Error,
    },
    /// A file for TLS is not usable.
    #[error("{}: {wrong}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        wrong: String,
    },
}

impl ListenerSettings {
    /// Rejects unsafe or contradictory settings.
    ///
    /// # Errors
    /// Names the problem and the remedy.
    pub fn check(&self) -> Result<(), ListenError> {
        if self.listen.is_empty() {
            return Err(ListenError::Nowhere);
        }
        if self.tls.is_some() && self.behind_proxy.is_some() {
            return Err(ListenError::Both);
        }
        let is_reachable = |address: &&SocketAddr| !address.ip().to_canonical().is_loopback();
        let reachable = self.listen.iter().find(is_reachable);
        match reachable {
            Some(address) if self.tls.is_none() && self.behind_proxy.is_none() => {
                Err(ListenError::Plain(*address))
            }
            _ => Ok(()),
        }
    }

    /// The names of this site, including those in its certificate.
    pub(crate) fn site(&self) -> Site {
        let certificate = self.tls.as_ref().map(|files| pki::Certificate::read(&files.certificate));
        let certified = certificate.and_then(Result::ok).map(|read| read.addresses);
        let certified = certified.unwrap_or_default();
        let certified = certified.iter().filter_map(|address| match address {
            pki::Address::Name(name) => Some(name.clone()),
            // Requests to an IP address are checked against the address of the connection.
            pki::Address::Ip(_) => None,
        });
        let given = self.names.iter().map(|name| name.to_ascii_lowercase());
        Site {
            is_tls: self.tls.is_some(),
            proxy: self.behind_proxy.clone(),
            names: given.chain(certified).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(listen: &[&str]) -> ListenerSettings {
        let listen = listen.iter().map(|address| address.parse().unwrap()).collect();
        ListenerSettings { listen, tls: None, behind_proxy: None, names: Vec::new() }
    }

    fn tls() -> TlsFiles {
        let file = |name: &str| PathBuf::from(name);
        TlsFiles { certificate: file("certificate.pem"), key: file("key.pem"), authority: None }
    }

    #[test]
    fn other_computers_reach_it_over_tls_or_by_a_proxy() {
        settings(&["127.0.0.1:8480", "[::1]:8480"]).check().unwrap();
        for reachable in ["0.0.0.0:8480", "192.0.2.10:8480", "[::]:8480"] {
            let plain = settings(&["127.0.0.1:8480", reachable]);
            let error = plain.check().unwrap_err().to_string();
            assert!(error.starts_with(reachable) && error.contains("plain HTTP"), "{error}");
            ListenerSettings { tls: Some(tls()), ..plain.clone() }.check().unwrap();
            let proxy = Some("https://tower.example".parse().unwrap());
            ListenerSettings { behind_proxy: proxy.clone(), ..plain.clone() }.check().unwrap();
            let both = ListenerSettings { behind_proxy: proxy, tls: Some(tls()), ..plain };
            assert!(matches!(both.check(), Err(ListenError::Both)));
        }
        assert!(matches!(settings(&[]).check(), Err(ListenError::Nowhere)));
    }
}
