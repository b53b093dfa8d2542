//! Revocation: replaces a certificate whose key is lost by one of the next generation, or removes it.
//!
//! A revoked certificate stays valid until it expires. Its rights end with access control rules that name only the next
//! generation; the rules are generated from the present and the revoked certificates.

use std::io;
use std::path::{Path, PathBuf};

use crate::authority::{Authority, IssueError};
use crate::certificate::Certificate;
use crate::holder::{CommonName, Holder, Issued};
use crate::identity;
use crate::library::Library;
use crate::lifetime::Lifetime;
use crate::private_files::{make_private_directory, replace_private, replace_public};

/// A certificate that was revoked.
#[derive(Debug, Clone)]
pub struct Revoked {
    /// Its common name.
    pub name: CommonName,
    /// The file of the certificate, without its key.
    pub kept: PathBuf,
    /// The addresses in the certificate.
    pub addresses: Vec<crate::Address>,
}

/// Why a certificate was not revoked.
#[derive(Debug, thiserror::Error)]
pub enum RevokeError {
    /// The holder has no certificate.
    #[error(
        "`{directory}` has no certificate of `{holder}`, only of {known}; if it was moved away, issue \
         `{holder}` again and then revoke that"
    )]
    Unknown {
        /// The library.
        directory: PathBuf,
        /// The holder.
        holder: Holder,
        /// Holders with a certificate.
        known: String,
    },
    /// The certificate is already revoked.
    #[error(
        "`{name}` is revoked already; remove `{directory}`, if it is there, and issue `{holder}` again; if \
         the next key has been issued before and is lost too, then revoke that"
    )]
    Already {
        /// Its common name.
        name: CommonName,
        /// The path of the holder's certificate, whether or not it exists.
        directory: PathBuf,
        /// The holder.
        holder: Holder,
    },
    /// A file of the identity cannot be removed.
    #[error(
        "`{file}` cannot be removed: {reason}; it is revoked, remove the remaining files by hand"
    )]
    Removing {
        /// The file.
        file: PathBuf,
        /// The cause.
        reason: io::Error,
    },
    /// The replacement cannot be issued.
    #[error(transparent)]
    Issue(#[from] IssueError),
}

/// Revokes a holder's certificate, and replaces it by a new key and a certificate of the next generation with the same
/// addresses.
///
/// # Errors
/// The certificate does not exist or is already revoked, or the replacement cannot be issued; then nothing is changed.
/// Or a file cannot be written.
pub fn replace(
    authority: &Authority,
    library: &Library,
    holder: &Holder,
    lifetime: Lifetime,
) -> Result<Revoked, RevokeError> {
    let old = present(authority, library, holder)?;
    let next = Issued { generation: old.name.issued.generation.next(), ..old.name.issued.clone() };
    let new = authority.make(next, &old.certificate.addresses, lifetime)?;
    let revoked = old.keep(library)?;
    let place = library.identity(holder);
    let written = |file: &Path, done: io::Result<()>| done.map_err(|reason| write(file, reason));
    written(&place.key, replace_private(&place.key, &new.key))?;
    written(&place.certificate, replace_public(&place.certificate, &new.certificate))?;
    Ok(revoked)
}

/// Revokes a holder's certificate without a replacement, and removes its directory.
///
/// # Errors
/// The certificate does not exist or is already revoked; then nothing is changed. Or a file cannot be written.
pub fn remove(
    authority: &Authority,
    library: &Library,
    holder: &Holder,
) -> Result<Revoked, RevokeError> {
    let revoked = present(authority, library, holder)?.keep(library)?;
    let place = library.identity(holder);
    // The certificate is deleted last, because the holder is listed as long as it exists.
    for file in [place.key, place.authority, place.certificate] {
        match std::fs::remove_file(&file) {
            Err(reason) if reason.kind() != io::ErrorKind::NotFound => {
                return Err(RevokeError::Removing { file, reason });
            }
            _ => {}
        }
    }
    let directory = library.place_of(holder);
    std::fs::remove_dir(&directory)
        .map_err(|reason| RevokeError::Removing { file: directory, reason })?;
    Ok(revoked)
}

/// A certificate to be revoked.
struct Old {
    name: CommonName,
    certificate: Certificate,
    pem: String,
}

/// The present certificate of a holder.
fn present(authority: &Authority, library: &Library, holder: &Holder) -> Result<Old, RevokeError> {
    let file = library.identity(holder).certificate;
    let refused = |reason: String| IssueError::NoCertificate { file: file.clone(), reason };
    let pem = match std::fs::read_to_string(&file) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(absent(authority, library, holder));
        }
        read => read.map_err(|error| refused(format!("cannot be read: {error}")))?,
    };
    let certificate = Certificate::from_pem(pem.as_bytes());
    let certificate = certificate.map_err(|error| refused(error.to_string()))?;
    if !identity::is_signed_by(&certificate, authority.certificate()) {
        return Err(refused("is not signed by this authority".to_owned()).into());
    }
    let text = certificate.common_name.as_deref().unwrap_or_default();
    let name: CommonName = text.parse().map_err(IssueError::Name)?;
    if name.issued.holder != *holder {
        return Err(refused(format!("was issued to `{name}`, not to `{holder}`")).into());
    }
    let revoked = library.revoked().map_err(|error| unreadable(library, &error))?;
    if revoked.iter().any(|known| known.holder == *holder && *known >= name.issued) {
        let directory = library.place_of(holder);
        return Err(RevokeError::Already { name, directory, holder: holder.clone() });
    }
    Ok(Old { name, certificate, pem })
}

impl Old {
    /// Stores the certificate among the revoked ones, so that its name is never issued again.
    fn keep(self, library: &Library) -> Result<Revoked, IssueError> {
        let kept = library.place_of_revoked(&self.name.issued);
        let directory = library.revoked_directory();
        make_private_directory(&directory).map_err(|reason| write(&directory, reason))?;
        replace_public(&kept, &self.pem).map_err(|reason| write(&kept, reason))?;
        Ok(Revoked { name: self.name, kept, addresses: self.certificate.addresses })
    }
}

/// The error for a holder without a certificate.
fn absent(authority: &Authority, library: &Library, holder: &Holder) -> RevokeError {
    let all = library.revoked().and_then(|revoked| Ok((revoked, library.holders()?)));
    let (revoked, holders) = match all {
        Ok(all) => all,
        Err(error) => return unreadable(library, &error).into(),
    };
    let directory = library.directory().to_owned();
    let holder = holder.clone();
    let latest = revoked.into_iter().filter(|known| known.holder == holder).max();
    let name = latest.map(|issued| CommonName { issued, structure: authority.structure().clone() });
    if let Some(name) = name {
        return RevokeError::Already { name, directory: library.place_of(&holder), holder };
    }
    let known: Vec<String> = holders.iter().map(|known| format!("`{known}`")).collect();
    let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
    RevokeError::Unknown { directory, holder, known }
}

fn unreadable(library: &Library, error: &io::Error) -> IssueError {
    let file = library.directory().to_owned();
    IssueError::NoCertificate { file, reason: format!("cannot be read: {error}") }
}

fn write(file: &Path, reason: io::Error) -> IssueError {
    IssueError::Write { file: file.to_owned(), reason }
}
