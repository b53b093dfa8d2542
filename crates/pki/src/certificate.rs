//! Reads certificates.

use std::io;
use std::net::IpAddr;
use std::path::Path;

use rustls::pki_types::CertificateDer;
use rustls::pki_types::pem::PemObject;
use time::OffsetDateTime;
use x509_parser::certificate::X509Certificate;
use x509_parser::extensions::GeneralName;
use x509_parser::prelude::FromDer;

use crate::address::Address;
use crate::lifetime::Lifetime;

/// A certificate as read from a file; nothing in it has been verified.
#[derive(Debug, Clone)]
pub struct Certificate {
    /// The common name of its holder.
    pub common_name: Option<String>,
    /// The addresses of its holder.
    pub addresses: Vec<Address>,
    /// Its period of validity.
    pub lifetime: Lifetime,
    /// The public key: the bit string, and its complete X.509 encoding.
    pub(crate) public_key: PublicKey,
    pub(crate) der: CertificateDer<'static>,
    /// Further certificates in the file.
    pub(crate) followers: Vec<CertificateDer<'static>>,
}

/// A public key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PublicKey {
    pub(crate) bits: Vec<u8>,
    pub(crate) whole: Vec<u8>,
}

/// Why a file is not a valid certificate.
#[derive(Debug, thiserror::Error)]
pub enum CertificateError {
    /// The file does not exist or cannot be read.
    #[error("cannot be read: {0}")]
    Unreadable(#[from] io::Error),
    /// The content is not a certificate.
    #[error("holds no certificate in PEM form")]
    NotOne,
}

impl Certificate {
    /// Reads the first certificate in a file.
    ///
    /// # Errors
    /// The file cannot be read or contains no certificate.
    pub fn read(file: &Path) -> Result<Self, CertificateError> {
        Self::from_pem(&std::fs::read(file)?)
    }

    /// The common name in a certificate received over TLS, if it has one.
    #[must_use]
    pub fn common_name_in(der: &CertificateDer<'_>) -> Option<String> {
        Self::from_der(der.clone().into_owned(), Vec::new())?.common_name
    }

    pub(crate) fn from_pem(text: &[u8]) -> Result<Self, CertificateError> {
        let all: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(text).collect();
        let mut all = all.map_err(|_| CertificateError::NotOne)?.into_iter();
        let first = all.next().ok_or(CertificateError::NotOne)?;
        Self::from_der(first, all.collect()).ok_or(CertificateError::NotOne)
    }

    fn from_der(
        der: CertificateDer<'static>,
        followers: Vec<CertificateDer<'static>>,
    ) -> Option<Self> {
        let bytes = der.clone();
        let (_, parsed) = X509Certificate::from_der(&bytes).ok()?;
        let common_name = parsed.subject().iter_common_name().next();
        let names = parsed.subject_alternative_name().ok().flatten();
        let names = names.map(|extension| &extension.value.general_names);
        Some(Self {
            common_name: common_name.and_then(|name| name.as_str().ok()).map(str::to_owned),
            addresses: names.into_iter().flatten().filter_map(address).collect(),
            lifetime: lifetime(&parsed)?,
            public_key: PublicKey {
                bits: parsed.public_key().subject_public_key.data.to_vec(),
                whole: parsed.public_key().raw.to_vec(),
            },
            der,
            followers,
        })
    }
}

fn lifetime(parsed: &X509Certificate<'_>) -> Option<Lifetime> {
    let time = |seconds| OffsetDateTime::from_unix_timestamp(seconds).ok();
    let validity = parsed.validity();
    let from = time(validity.not_before.timestamp())?;
    let until = time(validity.not_after.timestamp())?;
    Some(Lifetime { from, until })
}

fn address(name: &GeneralName<'_>) -> Option<Address> {
    match name {
        GeneralName::DNSName(name) => name.parse().ok(),
        GeneralName::IPAddress(bytes) => ip(bytes).map(Address::Ip),
        _ => None,
    }
}

fn ip(bytes: &[u8]) -> Option<IpAddr> {
    let four = <[u8; 4]>::try_from(bytes).ok().map(IpAddr::from);
    four.or_else(|| <[u8; 16]>::try_from(bytes).ok().map(IpAddr::from))
}
