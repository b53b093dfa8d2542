//! A person's key and certificate in one file, for a browser: PKCS #12 (RFC 7292), sealed with a password, by
//! AES-256 and HMAC-SHA-256.

use std::io;
use std::path::{Path, PathBuf};

use p12_keystore::{KeyStore, KeyStoreEntry, PrivateKey, PrivateKeyChain};
use rustls::pki_types::PrivateKeyDer;
use rustls::pki_types::pem::PemObject;

use crate::certificate::Certificate;
use crate::holder::{CommonName, Holder};
use crate::identity::{Identity, IdentityProblem};
use crate::private_files::create_private;

/// Shortest password, in characters: whoever gets hold of the file can guess as often as he likes.
pub const SHORTEST_PASSWORD: usize = 12;
/// Of generated passwords: letters and digits that are not mistaken for one another, 32 of them.
const ALPHABET: &[u8; 32] = b"abcdefghijkmnpqrstuvwxyz23456789";
/// Characters of a generated password: 100 bits.
const GENERATED: usize = 20;

/// Why no file was made.
#[derive(Debug, thiserror::Error)]
pub enum BrowserFileError {
    /// Something is wrong with the files of the holder.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    Problems(Vec<IdentityProblem>),
    /// A machine has no browser.
    #[error("`{0}` is not an operator or observer; only their certificates can be exported")]
    NoPerson(String),
    /// The password is too short.
    #[error(
        "the password has {0} characters; use {SHORTEST_PASSWORD} or more, or leave it out to have one made"
    )]
    Password(usize),
    /// The certificate or the key is of a kind that cannot stand in such a file.
    #[error("{}: cannot be sealed: {reason}", file.display())]
    Sealing {
        /// The file.
        file: PathBuf,
        /// Why.
        reason: String,
    },
    /// The disk refuses, or there is one already.
    #[error("{}: {reason}; a file that is there is never overwritten: remove it first", file.display())]
    Writing {
        /// The file.
        file: PathBuf,
        /// Why.
        reason: io::Error,
    },
    /// No randomness.
    #[error("system random number generator failed")]
    NoRandomness,
}

/// A password of 100 random bits, easily typed.
///
/// # Errors
/// The system has no random numbers.
pub fn password() -> Result<String, BrowserFileError> {
    let mut bytes = [0; GENERATED];
    let random = rustls::crypto::ring::default_provider().secure_random;
    random.fill(&mut bytes).map_err(|_| BrowserFileError::NoRandomness)?;
    // 256 is a multiple of 32: every character is as likely as any other.
    Ok(bytes.iter().map(|byte| char::from(ALPHABET[usize::from(byte % 32)])).collect())
}

/// Writes the key and the certificate of an operator or an observer, with the authority's certificate, into a file that
/// only its owner may read.
///
/// # Errors
/// The holder is no person, something is wrong with its files or with the password, or there is such a file already; then
/// none is written. Or the disk refuses.
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
    let PrivateKeyDer::Pkcs8(key) = key else { return Err("is no key in PKCS #8".to_owned()) };
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
