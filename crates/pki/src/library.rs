//! The directory with the authority and every identity that it has issued.

use std::path::{Path, PathBuf};

use crate::holder::Holder;
use crate::identity::Identity;

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
    pub fn holders(&self) -> std::io::Result<Vec<Holder>> {
        let mut holders = Vec::new();
        for entry in std::fs::read_dir(&self.directory)? {
            let name = entry?.file_name();
            let holder = name.to_str().and_then(|name| name.parse::<Holder>().ok());
            holders.extend(holder.filter(|holder| self.identity(holder).certificate.exists()));
        }
        holders.sort();
        Ok(holders)
    }
}
