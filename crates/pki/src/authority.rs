//! The certificate authority of a structure: creates itself, issues and renews certificates.
//!
//! Keys are ECDSA on P-256. A holder's certificate is for TLS clients, and also for servers if it names addresses.
//! Serial numbers are random.

use std::io;
use std::path::{Path, PathBuf};

use rcgen::{
    BasicConstraints, CertificateParams, DistinguishedName, DnType, ExtendedKeyUsagePurpose, IsCa,
    Issuer, KeyPair, KeyUsagePurpose, PublicKeyData, SanType, SerialNumber, SignatureAlgorithm,
};
use vocabulary::StructureName;

use crate::address::Address;
use crate::certificate::{Certificate, CertificateError, PublicKey};
use crate::holder::{AUTHORITY, CommonName, HolderError, Issued};
use crate::identity::{self, Identity};
use crate::lifetime::Lifetime;
use crate::private_files::{New, make_directory, replace_public};

/// Why an authority could not be used, or a certificate could not be issued.
#[derive(Debug, thiserror::Error)]
pub enum IssueError {
    /// The file or directory already exists.
    #[error("`{0}` already exists; renew its certificate, or remove it first")]
    Exists(PathBuf),
    /// A file cannot be written.
    #[error("`{file}` cannot be written: {reason}")]
    Write {
        /// The file.
        file: PathBuf,
        /// The cause.
        reason: io::Error,
    },
    /// The library lacks an authority.
    #[error("`{file}` {reason}; make an authority with `trusswatch pki authority STRUCTURE`")]
    NoAuthority {
        /// The missing or invalid file.
        file: PathBuf,
        /// The cause.
        reason: String,
    },
    /// A certificate cannot be renewed.
    #[error("`{file}` {reason}")]
    NoCertificate {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A name that no certificate can have.
    #[error(transparent)]
    Name(#[from] HolderError),
    /// The authority's certificate has expired.
    #[error(
        "the authority's certificate ended on {0}; make a new authority in a new directory and reissue everything"
    )]
    AuthorityEnded(String),
    /// The library that generates certificates failed.
    #[error("no certificate can be made: {0}")]
    Making(#[from] rcgen::Error),
    /// The random number generator failed.
    #[error("system random number generator failed")]
    NoRandomness,
}

/// A key and its certificate, in PEM form.
pub(crate) struct Made {
    pub(crate) key: String,
    pub(crate) certificate: String,
}

/// A structure's authority, with its private key.
#[derive(Debug)]
pub struct Authority {
    structure: StructureName,
    key: KeyPair,
    certificate: Certificate,
    pem: String,
}

impl Authority {
    /// Creates an authority in a library.
    ///
    /// # Errors
    /// The library already has an authority, or it cannot be written; then nothing was written.
    pub fn create(
        library: &Path,
        structure: StructureName,
        lifetime: Lifetime,
    ) -> Result<Self, IssueError> {
        let key = KeyPair::generate()?;
        let mut params = params(&name(&structure), lifetime)?;
        params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
        params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
        let pem = params.self_signed(&key)?.pem();
        let directory = library.join(AUTHORITY);
        make(
            &directory,
            &[
                New { name: identity::KEY, text: &key.serialize_pem(), private: true },
                New { name: identity::CERTIFICATE, text: &pem, private: false },
            ],
        )?;
        Self::open(library)
    }

    /// Reads the authority of a library.
    ///
    /// # Errors
    /// The library has no authority created by [`Authority::create`].
    pub fn open(library: &Path) -> Result<Self, IssueError> {
        let directory = library.join(AUTHORITY);
        let file = directory.join(identity::CERTIFICATE);
        let none =
            |file: &Path, reason: String| IssueError::NoAuthority { file: file.to_owned(), reason };
        let unreadable = |error: io::Error| none(&file, CertificateError::from(error).to_string());
        let pem = std::fs::read_to_string(&file).map_err(unreadable)?;
        let certificate = Certificate::from_pem(pem.as_bytes())
            .map_err(|error| none(&file, error.to_string()))?;
        let structure = certificate.common_name.as_deref().and_then(structure_of);
        let structure = structure.ok_or_else(|| {
            none(&file, "is not the certificate of an authority made by trusswatch".into())
        })?;
        let file = directory.join(identity::KEY);
        let unreadable = |error: io::Error| none(&file, CertificateError::from(error).to_string());
        let key = std::fs::read_to_string(&file).map_err(unreadable)?;
        let key = KeyPair::from_pem(&key).map_err(|_| none(&file, "holds no key".into()))?;
        if key.subject_public_key_info() != certificate.public_key.whole {
            return Err(none(&file, "does not belong to the certificate beside it".into()));
        }
        Ok(Self { structure, key, certificate, pem })
    }

    /// The structure of the authority.
    #[must_use]
    pub fn structure(&self) -> &StructureName {
        &self.structure
    }

    /// Its own certificate.
    #[must_use]
    pub fn certificate(&self) -> &Certificate {
        &self.certificate
    }

    /// Issues a key and a certificate to a holder, of the first or a later generation, in a new directory together with
    /// the authority's certificate. The certificate expires at the latest when the authority's does.
    ///
    /// # Errors
    /// The directory already exists or cannot be written; then nothing was written.
    pub fn issue(
        &self,
        directory: &Path,
        issued: impl Into<Issued>,
        addresses: &[Address],
        lifetime: Lifetime,
    ) -> Result<Identity, IssueError> {
        let made = self.make(issued.into(), addresses, lifetime)?;
        make(
            directory,
            &[
                New { name: identity::KEY, text: &made.key, private: true },
                New { name: identity::CERTIFICATE, text: &made.certificate, private: false },
                New { name: identity::AUTHORITY, text: &self.pem, private: false },
            ],
        )?;
        Ok(Identity::in_directory(directory))
    }

    /// Generates a key and a certificate without writing them.
    pub(crate) fn make(
        &self,
        issued: Issued,
        addresses: &[Address],
        lifetime: Lifetime,
    ) -> Result<Made, IssueError> {
        let name = CommonName::new(issued, self.structure.clone())?;
        let key = KeyPair::generate()?;
        let certificate = self.certify(&name.to_string(), addresses, lifetime, &key)?;
        Ok(Made { key: key.serialize_pem(), certificate })
    }

    /// Replaces a certificate by one with the same name, addresses and key and another lifetime. The key file is not
    /// read and may be missing.
    ///
    /// # Errors
    /// The certificate was not signed by this authority, or it cannot be written; then it is unchanged.
    pub fn renew(&self, identity: &Identity, lifetime: Lifetime) -> Result<(), IssueError> {
        let file = &identity.certificate;
        let refused = |reason: String| IssueError::NoCertificate { file: file.clone(), reason };
        let old = Certificate::read(file).map_err(|error| refused(error.to_string()))?;
        if !identity::is_signed_by(&old, &self.certificate) {
            return Err(refused("is not signed by this authority; issue a new one".into()));
        }
        let name = old.common_name.as_deref().unwrap_or_default();
        let renewed = self.certify(name, &old.addresses, lifetime, &old.public_key)?;
        replace_public(file, &renewed)
            .map_err(|reason| IssueError::Write { file: file.clone(), reason })
    }

    fn certify(
        &self,
        common_name: &str,
        addresses: &[Address],
        lifetime: Lifetime,
        key: &impl PublicKeyData,
    ) -> Result<String, IssueError> {
        let lifetime = lifetime.within(self.certificate.lifetime);
        if lifetime.until <= lifetime.from {
            let ended = self.certificate.lifetime.until.date();
            return Err(IssueError::AuthorityEnded(ended.to_string()));
        }
        let mut params = params(common_name, lifetime)?;
        params.is_ca = IsCa::ExplicitNoCa;
        params.use_authority_key_identifier_extension = true;
        params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
        params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ClientAuth];
        if !addresses.is_empty() {
            params.extended_key_usages.push(ExtendedKeyUsagePurpose::ServerAuth);
        }
        for address in addresses {
            params.subject_alt_names.push(match address {
                Address::Ip(ip) => SanType::IpAddress(*ip),
                Address::Name(name) => SanType::DnsName(name.as_str().try_into()?),
            });
        }
        let mut own = CertificateParams::default();
        own.distinguished_name = distinguished_name(&self::name(&self.structure));
        Ok(params.signed_by(key, &Issuer::from_params(&own, &self.key))?.pem())
    }
}

/// The public key of a certificate being renewed.
impl PublicKeyData for PublicKey {
    fn der_bytes(&self) -> &[u8] {
        &self.bits
    }

    /// The algorithm of every key that [`Authority::issue`] generates.
    fn algorithm(&self) -> &'static SignatureAlgorithm {
        &rcgen::PKCS_ECDSA_P256_SHA256
    }
}

const OF: &str = "authority of ";

/// The name in the authority's own certificate.
fn name(structure: &StructureName) -> String {
    format!("{OF}{structure}")
}

fn structure_of(name: &str) -> Option<StructureName> {
    name.strip_prefix(OF)?.parse().ok()
}

fn distinguished_name(common_name: &str) -> DistinguishedName {
    let mut name = DistinguishedName::new();
    name.push(DnType::CommonName, common_name);
    name
}

fn params(common_name: &str, lifetime: Lifetime) -> Result<CertificateParams, IssueError> {
    let mut params = CertificateParams::default();
    params.distinguished_name = distinguished_name(common_name);
    params.not_before = lifetime.from;
    params.not_after = lifetime.until;
    params.serial_number = Some(random_serial()?);
    Ok(params)
}

/// A random serial number as required by RFC 5280: positive, at most 20 octets.
fn random_serial() -> Result<SerialNumber, IssueError> {
    let mut octets = [0; 16];
    let random = rustls::crypto::ring::default_provider().secure_random;
    random.fill(&mut octets).map_err(|_| IssueError::NoRandomness)?;
    octets[0] &= 0x7f;
    Ok(SerialNumber::from_slice(&octets))
}

fn make(directory: &Path, files: &[New<'_>]) -> Result<(), IssueError> {
    make_directory(directory, files).map_err(|reason| match reason.kind() {
        io::ErrorKind::AlreadyExists | io::ErrorKind::DirectoryNotEmpty => {
            IssueError::Exists(directory.to_owned())
        }
        _ => IssueError::Write { file: directory.to_owned(), reason },
    })
}
