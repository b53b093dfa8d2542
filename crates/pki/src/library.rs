//! The directory with the authority, every identity that it has issued, and the certificates that are revoked.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use crate::certificate::Certificate;
use crate::holder::{CommonName, Generation, Holder, Issued, REVOKED};
use crate::identity::Identity;

/// Behind the name of a revoked certificate in the name of its file.
const PEM: &str = ".pem";

/// A directory of identities, each in a directory that is called like its holder.
#[derive(Debug, Clone)]
pub struct Library {
    directory: PathBuf,
}

impl Library {
    /// The library in this directory, which need not be there yet.
    #[must_use]
    pub fn at(directory: &Path) -> Self {
        Self { directory: directory.to_owned() }
    }

    /// Where it is.
    #[must_use]
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// Where a holder's identity is or would be.
    #[must_use]
    pub fn place_of(&self, holder: &Holder) -> PathBuf {
        self.directory.join(holder.to_string())
    }

    /// A holder's identity.
    #[must_use]
    pub fn identity(&self, holder: &Holder) -> Identity {
        Identity::in_directory(&self.place_of(holder))
    }

    /// Every holder with an identity here, by name.
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

    /// Every certificate that is revoked.
    ///
    /// # Errors
    /// There are some, but their directory cannot be read.
    pub fn revoked(&self) -> io::Result<Vec<Issued>> {
        match revoked_in(&self.revoked_directory()) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
            revoked => revoked,
        }
    }

    /// Where a revoked certificate is or would be.
    #[must_use]
    pub fn place_of_revoked(&self, issued: &Issued) -> PathBuf {
        self.revoked_directory().join(format!("{issued}{PEM}"))
    }

    pub(crate) fn revoked_directory(&self) -> PathBuf {
        self.directory.join(REVOKED)
    }

    /// The generation of every holder's certificate: of the present one, which comes after those that are
    /// revoked, or of the one that would be issued.
    ///
    /// # Errors
    /// The directory cannot be read.
    pub fn generations(&self) -> io::Result<Generations> {
        let holders = self.holders()?;
        let present = holders.iter().filter_map(|holder| self.present(holder)).collect();
        Ok(Generations::of_all(self.revoked()?, present))
    }

    /// A holder by the certificate that is here.
    #[must_use]
    pub fn present(&self, holder: &Holder) -> Option<Issued> {
        let read = Certificate::read(&self.identity(holder).certificate).ok()?;
        let name: CommonName = read.common_name?.parse().ok()?;
        (name.issued.holder == *holder).then_some(name.issued)
    }
}

/// Every certificate in a directory of revoked ones, such as a copy of `pki/revoked`, by the names of the files.
///
/// # Errors
/// The directory is not there or cannot be read.
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

/// The generation of each holder's present certificate; one of whom nothing is known has the first, or would get it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Generations(BTreeMap<Holder, Generation>);

impl Generations {
    /// After those that are revoked, and not before those that are present.
    fn of_all(revoked: Vec<Issued>, present: Vec<Issued>) -> Self {
        let after = |revoked: Issued| Issued { generation: revoked.generation.next(), ..revoked };
        let mut latest = BTreeMap::new();
        for Issued { holder, generation } in revoked.into_iter().map(after).chain(present) {
            let known = latest.entry(holder).or_insert(generation);
            *known = generation.max(*known);
        }
        Self(latest)
    }

    /// A holder by the present certificate, or by the one that would be issued.
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
