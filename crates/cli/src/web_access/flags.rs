//! What `trusswatch web` takes for who gets to the page.

use std::net::SocketAddr;
use std::path::PathBuf;

use web::{ListenerSettings, Origin, TlsFiles};

use crate::failure::Failure;

/// Who gets to the page, and by which way.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Access to the page")]
pub(crate) struct AccessFlags {
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
    /// The page's address at a proxy that does TLS, https://NAME
    #[arg(long, value_name = "ORIGIN", conflicts_with = "page_certificate")]
    behind_proxy: Option<Origin>,
    /// A further name of the page, NAME or NAME:PORT; those in its certificate need not be named. May be repeated
    #[arg(long = "page-name", value_name = "NAME")]
    names: Vec<String>,
    /// Whoever has not signed in sees nothing
    #[arg(long)]
    pub(crate) require_sign_in: bool,
}

impl AccessFlags {
    /// Where the page is served, checked.
    pub(crate) fn listener(&self, listen: SocketAddr) -> Result<ListenerSettings, Failure> {
        let files = self.page_certificate.clone().zip(self.page_key.clone());
        let authority = self.page_authority.clone();
        let tls = files.map(|(certificate, key)| TlsFiles { certificate, key, authority });
        let (behind_proxy, names) = (self.behind_proxy.clone(), self.names.clone());
        let settings = ListenerSettings { listen: vec![listen], tls, behind_proxy, names };
        settings.check().map_err(|error| Failure::usage(error.to_string()))?;
        Ok(settings)
    }

    /// The directory of certificates that are revoked, which has to be there: a wrong name must not let anybody in.
    pub(crate) fn revoked(&self) -> Result<Option<PathBuf>, Failure> {
        if let Some(directory) = &self.revoked
            && let Err(error) = std::fs::read_dir(directory)
        {
            let right = "make it, empty if no certificate is revoked";
            return Err(Failure::input(format!("{}: {error}; {right}", directory.display())));
        }
        Ok(self.revoked.clone())
    }
}
