//! Who reaches the page and how: its certificate, its names, sign-in.

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;

use super::site::{PageAddress, Site};

/// Access to the page.
#[derive(Debug, Clone, Default, clap::Args)]
#[command(next_help_heading = "Access to the page")]
pub struct PageAccess {
    /// The page's certificate (PEM), for TLS
    #[arg(long, value_name = "FILE", requires = "page_key")]
    pub page_certificate: Option<PathBuf>,
    /// The key of that certificate
    #[arg(long, value_name = "FILE", requires = "page_certificate")]
    pub page_key: Option<PathBuf>,
    /// The structure's authority: operators and observers sign in with its certificates in their browsers
    #[arg(long, value_name = "FILE", requires = "page_certificate")]
    pub page_authority: Option<PathBuf>,
    /// A directory with the certificates that are revoked, such as a copy of pki/revoked
    #[arg(long, value_name = "DIRECTORY", requires = "page_authority")]
    pub revoked: Option<PathBuf>,
    /// The page's address at a proxy that terminates TLS: https://NAME, or https://NAME/PATH if the proxy strips that path
    #[arg(long, value_name = "ADDRESS", conflicts_with = "page_certificate")]
    pub behind_proxy: Option<PageAddress>,
    /// A further name of the page, NAME or NAME:PORT, beside those in its certificate; may be repeated
    #[arg(long = "page-name", value_name = "NAME")]
    pub names: Vec<String>,
    /// Show nothing before sign-in
    #[arg(long)]
    pub require_sign_in: bool,
}

/// Why the page cannot be served.
#[derive(Debug, thiserror::Error)]
pub enum ListenError {
    /// Plain HTTP on the network would let anyone read pages and take over sessions.
    #[error(
        "{0} can be reached from other computers, over plain HTTP; give a certificate and its key, or listen on \
         127.0.0.1 behind a proxy that does TLS, or name that proxy's address, https://NAME"
    )]
    Plain(SocketAddr),
    /// Both the proxy and this process would do TLS.
    #[error("TLS at a proxy and TLS here exclude each other; use one of them")]
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

impl PageAccess {
    /// Rejects unsafe or contradictory settings of a page on this address.
    ///
    /// # Errors
    /// Names the problem and the remedy.
    pub fn check(&self, listen: SocketAddr) -> Result<(), ListenError> {
        let (is_tls, is_behind_proxy) =
            (self.page_certificate.is_some(), self.behind_proxy.is_some());
        match (is_tls, is_behind_proxy) {
            (true, true) => Err(ListenError::Both),
            (false, false) if !listen.ip().to_canonical().is_loopback() => {
                Err(ListenError::Plain(listen))
            }
            _ => Ok(()),
        }
    }

    /// The names of this site, including those in its certificate.
    pub(crate) fn site(&self) -> Site {
        let certificate = self.page_certificate.as_deref().map(pki::Certificate::read);
        let certified = certificate.and_then(Result::ok).map(|read| read.addresses);
        let certified = certified.unwrap_or_default();
        let certified = certified.iter().filter_map(|address| match address {
            pki::Address::Name(name) => Some(name.clone()),
            // Requests to an IP address are checked against the address of the connection.
            pki::Address::Ip(_) => None,
        });
        let given = self.names.iter().map(|name| name.to_ascii_lowercase());
        Site {
            is_tls: self.page_certificate.is_some(),
            proxy: self.behind_proxy.clone(),
            names: given.chain(certified).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_computers_reach_it_over_tls_or_by_a_proxy() {
        let plain = PageAccess::default();
        for local in ["127.0.0.1:8480", "[::1]:8480"] {
            plain.check(local.parse().unwrap()).unwrap();
        }
        for reachable in ["0.0.0.0:8480", "192.0.2.10:8480", "[::]:8480"] {
            let listen = reachable.parse().unwrap();
            let error = plain.check(listen).unwrap_err().to_string();
            assert!(error.starts_with(reachable) && error.contains("plain HTTP"), "{error}");
            let page_certificate = Some(PathBuf::from("certificate.pem"));
            PageAccess { page_certificate: page_certificate.clone(), ..plain.clone() }
                .check(listen)
                .unwrap();
            let behind_proxy = Some("https://tower.example".parse().unwrap());
            let proxy = PageAccess { behind_proxy, ..plain.clone() };
            proxy.check(listen).unwrap();
            let both = PageAccess { page_certificate, ..proxy };
            assert!(matches!(both.check(listen), Err(ListenError::Both)));
        }
    }
}
