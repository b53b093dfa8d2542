//! The files that a holder authenticates with, and checks of them.

use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rustls::crypto::CryptoProvider;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{PrivateKeyDer, UnixTime};
use rustls::server::WebPkiClientVerifier;
use rustls::sign::CertifiedKey;
use rustls::{InconsistentKeys, RootCertStore};
use time::OffsetDateTime;

use crate::address::Address;
use crate::certificate::Certificate;
use crate::holder::CommonName;
use crate::lifetime::{Lifetime, now};
use crate::private_files::PRIVATE;

/// File name of the authority's certificate.
pub const AUTHORITY: &str = "authority.pem";
/// File name of the holder's certificate.
pub const CERTIFICATE: &str = "certificate.pem";
/// File name of the holder's key.
pub const KEY: &str = "key.pem";

/// The paths of a holder's files.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Identity {
    /// The authority's certificate.
    pub authority: PathBuf,
    /// The holder's certificate.
    pub certificate: PathBuf,
    /// The holder's key.
    pub key: PathBuf,
}

/// A problem of a file, with the remedy.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}: {wrong}", file.display())]
pub struct IdentityProblem {
    /// The file.
    pub file: PathBuf,
    /// The problem.
    pub wrong: FileProblem,
}

/// A problem of a file of an identity.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FileProblem {
    /// The file is missing, not readable or not what it should be.
    #[error("{0}")]
    Unusable(String),
    /// The certificate has expired.
    #[error("expired on {0}; renew it with `trusswatch pki renew`")]
    Expired(String),
    /// The certificate is not valid yet, or this computer's clock is behind.
    #[error("is not valid before {from}, and this computer's clock says {now}; set the clock")]
    NotYetValid {
        /// When it becomes valid.
        from: String,
        /// The time of this computer's clock.
        now: String,
    },
    /// The certificate was issued to another holder.
    #[error(
        "was issued to `{found}`, but this is `{expected}`; use the certificate of `{expected}`"
    )]
    OtherName {
        /// The holder in the certificate.
        found: String,
        /// The expected holder.
        expected: String,
    },
    /// The certificate is signed by another authority, or not for this use.
    #[error("is not signed by the authority in `{}`; use the certificate and the authority that were issued together", .0.display())]
    OtherAuthority(PathBuf),
    /// The certificate lacks an address of this process, so clients would reject it.
    #[error("does not name {0}, where this process listens; issue it with `--address {0}`")]
    OtherAddress(Address),
    /// The key is readable by other users.
    #[error(
        "readable by other users (mode {0:04o}); set mode {PRIVATE:04o}, and issue a new key if it may have been read"
    )]
    Exposed(u32),
    /// The key belongs to another certificate.
    #[error("does not belong to the certificate in `{}`; use the key that was issued with it", .0.display())]
    OtherKey(PathBuf),
}

impl FileProblem {
    /// Whether the problem depends on the time, while the files stay the same.
    #[must_use]
    pub fn passes(&self) -> bool {
        matches!(self, FileProblem::Expired(_) | FileProblem::NotYetValid { .. })
    }
}

impl Identity {
    /// The files in a directory created by `trusswatch pki issue`.
    #[must_use]
    pub fn in_directory(directory: &Path) -> Self {
        Self {
            authority: directory.join(AUTHORITY),
            certificate: directory.join(CERTIFICATE),
            key: directory.join(KEY),
        }
    }

    /// All problems of the files: of each file, between the files, and with the expected name in any generation.
    /// `listening` lists the addresses on which the holder listens.
    #[must_use]
    pub fn problems(
        &self,
        expected: Option<&CommonName>,
        listening: &[Address],
    ) -> Vec<IdentityProblem> {
        self.problems_at(now(), expected, listening)
    }

    fn problems_at(
        &self,
        now: OffsetDateTime,
        expected: Option<&CommonName>,
        listening: &[Address],
    ) -> Vec<IdentityProblem> {
        let mut problems = Vec::new();
        let mut found =
            |file: &Path, wrong| problems.push(IdentityProblem { file: file.to_owned(), wrong });
        let authority = read(&self.authority).map_err(|wrong| found(&self.authority, wrong)).ok();
        let own = read(&self.certificate).map_err(|wrong| found(&self.certificate, wrong)).ok();
        for (file, certificate) in [(&self.authority, &authority), (&self.certificate, &own)] {
            let untimely = certificate.as_ref().and_then(|read| untimely(read.lifetime, now));
            untimely.into_iter().for_each(|wrong| found(file, wrong));
        }
        if let Some(own) = &own {
            for wrong in wrong_for(own, expected, listening) {
                found(&self.certificate, wrong);
            }
        }
        if let (Some(own), Some(authority)) = (&own, &authority)
            && !is_signed_by(own, authority)
        {
            found(&self.certificate, FileProblem::OtherAuthority(self.authority.clone()));
        }
        for wrong in self.wrong_with_key(own.as_ref()) {
            found(&self.key, wrong);
        }
        problems
    }

    fn wrong_with_key(&self, certificate: Option<&Certificate>) -> Vec<FileProblem> {
        let mut wrong = Vec::new();
        let mode = self.key.metadata().map_or(0, |metadata| metadata.permissions().mode()) & 0o777;
        if mode & 0o007 != 0 {
            wrong.push(FileProblem::Exposed(mode));
        }
        let text = match std::fs::read(&self.key) {
            Ok(text) => text,
            Err(error) => {
                wrong.push(unreadable(&error));
                return wrong;
            }
        };
        let provider = provider();
        let key = PrivateKeyDer::from_pem_slice(&text).ok();
        let key = key.and_then(|key| provider.key_provider.load_private_key(key).ok());
        match (key, certificate) {
            (None, _) => {
                wrong.push(FileProblem::Unusable("holds no private key in PEM form".into()))
            }
            (Some(_), None) => {}
            (Some(key), Some(certificate)) => {
                let pair = CertifiedKey::new(vec![certificate.der.clone()], key);
                let matches = pair.keys_match();
                if !matches!(
                    matches,
                    Ok(()) | Err(rustls::Error::InconsistentKeys(InconsistentKeys::Unknown))
                ) {
                    wrong.push(FileProblem::OtherKey(self.certificate.clone()));
                }
            }
        }
        wrong
    }
}

fn read(file: &Path) -> Result<Certificate, FileProblem> {
    Certificate::read(file).map_err(|error| FileProblem::Unusable(error.to_string()))
}

fn unreadable(error: &io::Error) -> FileProblem {
    FileProblem::Unusable(format!("cannot be read: {error}"))
}

fn untimely(lifetime: Lifetime, now: OffsetDateTime) -> Option<FileProblem> {
    let day = |time: OffsetDateTime| time.date().to_string();
    if now > lifetime.until {
        return Some(FileProblem::Expired(day(lifetime.until)));
    }
    let early = now < lifetime.from;
    early.then(|| FileProblem::NotYetValid { from: day(lifetime.from), now: day(now) })
}

fn wrong_for(
    own: &Certificate,
    expected: Option<&CommonName>,
    listening: &[Address],
) -> Vec<FileProblem> {
    let found = own.common_name.clone().unwrap_or_else(|| "unnamed".to_owned());
    let name = found.parse::<CommonName>().ok();
    let is_other = |expected: &&CommonName| !name.is_some_and(|own| own.is_of_holder_of(expected));
    let expected = expected.filter(is_other).map(ToString::to_string);
    let name = expected.map(|expected| FileProblem::OtherName { found, expected });
    let is_named = |address: &&Address| !own.addresses.contains(address);
    let addresses = listening.iter().filter(is_named).cloned().map(FileProblem::OtherAddress);
    name.into_iter().chain(addresses).collect()
}

fn provider() -> Arc<CryptoProvider> {
    Arc::new(rustls::crypto::ring::default_provider())
}

/// Whether TLS accepts the authority's signature on the certificate. The check uses the beginning of the certificate's
/// validity, so that the result does not depend on the present time.
pub(crate) fn is_signed_by(own: &Certificate, authority: &Certificate) -> bool {
    let mut roots = RootCertStore::empty();
    if roots.add(authority.der.clone()).is_err() {
        return false;
    }
    let verifier = WebPkiClientVerifier::builder_with_provider(roots.into(), provider()).build();
    let seconds = u64::try_from(own.lifetime.from.unix_timestamp()).unwrap_or(0);
    let moment = UnixTime::since_unix_epoch(std::time::Duration::from_secs(seconds));
    let verify = |verifier: Arc<dyn rustls::server::danger::ClientCertVerifier>| {
        verifier.verify_client_cert(&own.der, &own.followers, moment).is_ok()
    };
    verifier.is_ok_and(verify)
}
