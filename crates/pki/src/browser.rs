//! Exports a person's key and certificate to one file for a browser: PKCS #12 (RFC 7292), encrypted with a password by
//! AES-256 and authenticated with HMAC-SHA-256.

use std::io;
use std::path::{Path, PathBuf};

use p12_keystore::{KeyStore, KeyStoreEntry, PrivateKey, PrivateKeyChain};
use rustls::pki_types::PrivateKeyDer;
use rustls::pki_types::pem::PemObject;

use crate::certificate::Certificate;
use crate::holder::{CommonName, Holder};
use crate::identity::{Identity, IdentityProblem};
use crate::private_files::create_private;

/// Shortest password, in characters: an attacker with the file can try any number of passwords.
pub const SHORTEST_PASSWORD: usize = 12;
/// The alphabet of generated passwords: 32 letters and digits that are not easily confused.
const ALPHABET: &[u8; 32] = b"abcdefghijkmnpqrstuvwxyz23456789";
/// Length of a generated password: 100 bits.
const GENERATED: usize = 20;

/// Why no file was written.
#[derive(Debug, thiserror::Error)]
pub enum BrowserFileError {
    /// The files of the holder are invalid.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    Problems(Vec<IdentityProblem>),
    /// The holder is a machine, which has no browser.
    #[error("`{0}` is not an operator or observer; only their certificates can be exported")]
    NoPerson(String),
    /// The password is too short.
    #[error(
        "the password has {0} characters; use {SHORTEST_PASSWORD} or more, or none, to generate one"
    )]
    Password(usize),
    /// PKCS #12 does not support this kind of certificate or key.
    #[error("{}: cannot be encrypted: {reason}", file.display())]
    Sealing {
        /// The file.
        file: PathBuf,
        /// The cause.
        reason: String,
    },
    /// The file already exists or cannot be written.
    #[error("{}: {reason}; existing files are never overwritten: remove it first", file.display())]
    Writing {
        /// The file.
        file: PathBuf,
        /// The cause.
        reason: io::Error,
    },
    /// The random number generator failed.
    #[error("system random number generator failed")]
    NoRandomness,
}

/// Generates a password of 100 random bits that is easy to type.
///
/// # Errors
/// The system's random number generator failed.
pub fn password() -> Result<String, BrowserFileError> {
    let mut bytes = [0; GENERATED];
    let random = rustls::crypto::ring::default_provider().secure_random;
    random.fill(&mut bytes).map_err(|_| BrowserFileError::NoRandomness)?;
    // 256 is a multiple of 32, so all characters are equally likely.
    Ok(bytes.iter().map(|byte| char::from(ALPHABET[usize::from(byte % 32)])).collect())
}

/// Writes the key and the certificate of an operator or an observer, with the authority's certificate, to a file
/// readable by its owner only.
///
/// # Errors
/// The holder is a machine, its files or the password are invalid, the file already exists, or it cannot be written. An
/// existing file is never changed.
pub fn write(identity: &Identity, password: &str, file: &Path) -> Result<(), BrowserFileError> {
    let length = password.chars().count();
    if length < SHORTEST_PASSWORD {
        return Err(BrowserFileError::Password(length));
    }
    let problems = identity.problems(None, &[]);
    if !problems.is_empty() {
        return Err(BrowserFileError::Problems(problems));
    }
    let sealed = sealed(identity, password)?;
    let writing = |reason| BrowserFileError::Writing { file: file.to_owned(), reason };
    create_private(file, &sealed).map_err(writing)
}

fn sealed(identity: &Identity, password: &str) -> Result<Vec<u8>, BrowserFileError> {
    let unusable = |file: &Path| {
        let file = file.to_owned();
        move |reason: String| BrowserFileError::Sealing { file, reason }
    };
    let own = read(&identity.certificate).map_err(unusable(&identity.certificate))?;
    let authority = read(&identity.authority).map_err(unusable(&identity.authority))?;
    let name = person(&own)?;
    let key = key(&identity.key).map_err(unusable(&identity.key))?;
    let chain = [(&own, &identity.certificate), (&authority, &identity.authority)];
    let chain = chain.map(|(certificate, file)| {
        let sealed = p12_keystore::Certificate::from_der(&certificate.der);
        sealed.map_err(|error| unusable(file)(error.to_string()))
    });
    let [own, authority] = chain;
    let chain = PrivateKeyChain::new(name.as_bytes(), key, [own?, authority?]);
    let mut store = KeyStore::new();
    store.add_entry(&name, KeyStoreEntry::PrivateKeyChain(chain));
    let sealed = store.writer(password).write();
    sealed.map_err(|error| unusable(&identity.certificate)(error.to_string()))
}

fn person(own: &Certificate) -> Result<String, BrowserFileError> {
    let text = own.common_name.clone().unwrap_or_default();
    let holder = text.parse::<CommonName>().map(|name| name.issued.holder);
    match holder {
        Ok(Holder::Operator(_) | Holder::Observer(_)) => Ok(text),
        _ => Err(BrowserFileError::NoPerson(text)),
    }
}

fn read(file: &Path) -> Result<Certificate, String> {
    Certificate::read(file).map_err(|error| error.to_string())
}

fn key(file: &Path) -> Result<PrivateKey, String> {
    let key = PrivateKeyDer::from_pem_file(file).map_err(|error| error.to_string())?;
    let PrivateKeyDer::Pkcs8(key) = key else { return Err("is not a key in PKCS #8".to_owned()) };
    PrivateKey::from_der(key.secret_pkcs8_der()).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passwords_are_long_and_differ() {
        let (one, other) = (password().unwrap(), password().unwrap());
        assert_ne!(one, other);
        assert_eq!(one.len(), GENERATED);
        assert!(one.bytes().all(|byte| ALPHABET.contains(&byte)));
    }
}
