//! The directory with the authority, all issued identities, and the revoked certificates.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use crate::certificate::Certificate;
use crate::holder::{CommonName, Generation, Holder, Issued, REVOKED};
use crate::identity::Identity;

/// Suffix of the file of a revoked certificate, after its name.
const PEM: &str = ".pem";

/// A directory of identities, each in a subdirectory named after its holder.
#[derive(Debug, Clone)]
pub struct Library {
    directory: PathBuf,
}

impl Library {
    /// The library in this directory, which may not exist yet.
    #[must_use]
    pub fn at(directory: &Path) -> Self {
        Self { directory: directory.to_owned() }
    }

    /// Its directory.
    #[must_use]
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// The path of a holder's identity, whether or not it exists.
    #[must_use]
    pub fn place_of(&self, holder: &Holder) -> PathBuf {
        self.directory.join(holder.to_string())
    }

    /// A holder's identity.
    #[must_use]
    pub fn identity(&self, holder: &Holder) -> Identity {
        Identity::in_directory(&self.place_of(holder))
    }

    /// All holders with an identity in the library, sorted by name.
    ///
    /// # Errors
    /// The directory cannot be read.
    pub fn holders(&self) -> io::Result<Vec<Holder>> {
        let mut holders = Vec::new();
        for entry in std::fs::read_dir(&self.directory)? {
            let name = entry?.file_name();
            let holder = name.to_str().and_then(|name| name.parse::<Holder>().ok());
            holders.extend(holder.filter(|holder| self.identity(holder).certificate.exists()));
        }
        holders.sort();
        Ok(holders)
    }

    /// All revoked certificates; none without a directory of them.
    ///
    /// # Errors
    /// The directory exists but cannot be read.
    pub fn revoked(&self) -> io::Result<Vec<Issued>> {
        match revoked_in(&self.revoked_directory()) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
            revoked => revoked,
        }
    }

    /// The path of a revoked certificate, whether or not it exists.
    #[must_use]
    pub fn place_of_revoked(&self, issued: &Issued) -> PathBuf {
        self.revoked_directory().join(format!("{issued}{PEM}"))
    }

    pub(crate) fn revoked_directory(&self) -> PathBuf {
        self.directory.join(REVOKED)
    }

    /// The generation of each holder's certificate: of the present one or, after a revocation, of the one to be issued
    /// next.
    ///
    /// # Errors
    /// The directory cannot be read.
    pub fn generations(&self) -> io::Result<Generations> {
        let holders = self.holders()?;
        let present = holders.iter().filter_map(|holder| self.present(holder)).collect();
        Ok(Generations::of_all(self.revoked()?, present))
    }

    /// A holder with the generation of the certificate in the library.
    #[must_use]
    pub fn present(&self, holder: &Holder) -> Option<Issued> {
        let read = Certificate::read(&self.identity(holder).certificate).ok()?;
        let name: CommonName = read.common_name?.parse().ok()?;
        (name.issued.holder == *holder).then_some(name.issued)
    }
}

/// All certificates in a directory of revoked ones, such as a copy of `pki/revoked`, according to the names of the
/// files.
///
/// # Errors
/// The directory does not exist or cannot be read.
pub fn revoked_in(directory: &Path) -> io::Result<Vec<Issued>> {
    let mut revoked = Vec::new();
    for entry in std::fs::read_dir(directory)? {
        let name = entry?.file_name();
        let name = name.to_str().and_then(|name| name.strip_suffix(PEM));
        revoked.extend(name.and_then(|name| name.parse::<Issued>().ok()));
    }
    revoked.sort();
    Ok(revoked)
}

/// The generation of each holder's present certificate, or of the one to be issued; the first for unknown holders.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Generations(BTreeMap<Holder, Generation>);

impl Generations {
    /// For each holder the highest of the present generations and the successors of revoked ones.
    fn of_all(revoked: Vec<Issued>, present: Vec<Issued>) -> Self {
        let after = |revoked: Issued| Issued { generation: revoked.generation.next(), ..revoked };
        let mut latest = BTreeMap::new();
        for Issued { holder, generation } in revoked.into_iter().map(after).chain(present) {
            let known = latest.entry(holder).or_insert(generation);
            *known = generation.max(*known);
        }
        Self(latest)
    }

    /// A holder with the generation of the present certificate, or of the one to be issued.
    #[must_use]
    pub fn of(&self, holder: Holder) -> Issued {
        let generation = self.0.get(&holder).copied().unwrap_or(Generation::FIRST);
        Issued { holder, generation }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_present_one_comes_after_every_revoked_one() {
        let all = |texts: &[&str]| texts.iter().map(|text| text.parse().unwrap()).collect();
        let revoked = all(&["module1~2", "module1", "operator.ada"]);
        let generations = Generations::of_all(revoked, all(&["module1~2", "module2~5", "plant"]));
        for text in ["module1~3", "operator.ada~2", "module2~5", "plant", "observer.wall"] {
            let issued: Issued = text.parse().unwrap();
            assert_eq!(generations.of(issued.holder.clone()), issued);
        }
    }
}
