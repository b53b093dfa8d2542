//! Access to the page of `trusswatch web`; and `trusswatch web link`, which creates a link that admits a user once.

use std::io::Write;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use web::{LinkError, ListenerSettings, PageAddress, PersonName, TlsFiles};

use crate::failure::Failure;
use crate::output;

/// Who gets to the page, and by which way.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Access to the page")]
pub(super) struct AccessFlags {
    /// The page's certificate (PEM), for TLS
    #[arg(long, value_name = "FILE", requires = "page_key")]
    page_certificate: Option<PathBuf>,
    /// The key of that certificate
    #[arg(long, value_name = "FILE", requires = "page_certificate")]
    page_key: Option<PathBuf>,
    /// The structure's authority: operators and observers sign in with its certificates in their browsers
    #[arg(long, value_name = "FILE", requires = "page_certificate")]
    page_authority: Option<PathBuf>,
    /// A directory with the certificates that are revoked, such as a copy of pki/revoked
    #[arg(long, value_name = "DIRECTORY", requires = "page_authority")]
    revoked: Option<PathBuf>,
    /// The page's address at a proxy that does TLS: https://NAME, or https://NAME/PATH if the proxy strips that path
    #[arg(long, value_name = "ADDRESS", conflicts_with = "page_certificate")]
    behind_proxy: Option<PageAddress>,
    /// A further name of the page, NAME or NAME:PORT; those in its certificate need not be named. May be repeated
    #[arg(long = "page-name", value_name = "NAME")]
    names: Vec<String>,
    /// Show nothing before sign-in
    #[arg(long)]
    pub(super) require_sign_in: bool,
}

impl AccessFlags {
    /// The address and protocol of the page, checked.
    pub(super) fn listener(&self, listen: SocketAddr) -> Result<ListenerSettings, Failure> {
        let files = self.page_certificate.clone().zip(self.page_key.clone());
        let authority = self.page_authority.clone();
        let tls = files.map(|(certificate, key)| TlsFiles { certificate, key, authority });
        let (behind_proxy, names) = (self.behind_proxy.clone(), self.names.clone());
        let settings = ListenerSettings { listen: vec![listen], tls, behind_proxy, names };
        settings.check().map_err(|error| Failure::usage(error.to_string()))?;
        Ok(settings)
    }

    /// The directory of revoked certificates, which must exist, so that a wrong name does not admit users with revoked
    /// ones.
    pub(super) fn revoked(&self) -> Result<Option<PathBuf>, Failure> {
        if let Some(directory) = &self.revoked
            && let Err(error) = std::fs::read_dir(directory)
        {
            let right = "make it, empty if no certificate is revoked";
            return Err(Failure::input(format!("{}: {error}; {right}", directory.display())));
        }
        Ok(self.revoked.clone())
    }
}

/// Make a link by which a person signs in to the page, once
///
/// Prints the link; hand it to the person over a private channel. Run this as root or as the user that
/// `trusswatch web` runs as, on its computer. The person's name stands in the journals with every order.
#[derive(Debug, clap::Args)]
pub(super) struct OneTimeLinkArguments {
    /// The person's name, as journals are to have it
    #[arg(value_name = "PERSON")]
    person: PersonName,
    /// The directory that `trusswatch web` has as --state-dir
    #[arg(long, value_name = "DIRECTORY", default_value = "/var/lib/trusswatch-web")]
    state_dir: PathBuf,
    /// Read-only access
    #[arg(long)]
    view_only: bool,
    /// For how long the link is good, from 1s to 24h
    #[arg(long, value_name = "SPAN", default_value = "10m", value_parser = valid)]
    valid: Duration,
    /// The address of the page, as the person's browser has it
    #[arg(long, value_name = "ADDRESS", default_value = "http://127.0.0.1:8480")]
    address: PageAddress,
}

/// Runs `trusswatch web link`.
pub(super) fn link(arguments: &OneTimeLinkArguments) -> Result<(), Failure> {
    let OneTimeLinkArguments { person, state_dir, view_only, valid, address } = arguments;
    let link = web::one_time_link(state_dir, person, !view_only, *valid)?;
    writeln!(output::stdout(), "{address}{link}")?;
    Ok(())
}

fn valid(text: &str) -> Result<Duration, String> {
    let span = humantime::parse_duration(text).ok().filter(|span| web::VALID.contains(span));
    span.ok_or_else(|| "write a time span from 1s to 24h, e.g. 10m".to_owned())
}

impl From<LinkError> for Failure {
    fn from(error: LinkError) -> Failure {
        match error {
            LinkError::Randomness(_) => Failure::runtime(error.to_string()),
            LinkError::Valid(_) => Failure::usage(error.to_string()),
            LinkError::Directory { .. } | LinkError::TooMany(_) => {
                Failure::input(error.to_string())
            }
        }
    }
}
