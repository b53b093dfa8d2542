//! The output directory. Existing files are never overwritten.

use std::fs;
use std::path::{Path, PathBuf};

use crate::failure::Failure;

pub(crate) struct Directory(PathBuf);

impl Directory {
    /// Claims a directory that does not exist or is empty.
    pub(crate) fn claim(path: &Path) -> Result<Directory, Failure> {
        let unusable = |error: std::io::Error| {
            Failure::runtime(format!("cannot use `{}` as a directory: {error}", path.display()))
        };
        fs::create_dir_all(path).map_err(unusable)?;
        if fs::read_dir(path).map_err(unusable)?.next().is_some() {
            return Err(Failure::runtime(format!(
                "`{}` has files in it, which are left as they are; name a new directory",
                path.display()
            )));
        }
        Ok(Directory(path.to_owned()))
    }

    /// Writes a file, given its path in the directory.
    pub(crate) fn write(&self, file: &str, text: &str) -> Result<(), Failure> {
        let path = self.0.join(file);
        let folder = path.parent().unwrap_or(&self.0);
        fs::create_dir_all(folder).and_then(|()| fs::write(&path, text)).map_err(|error| {
            Failure::runtime(format!("cannot write `{}`: {error}", path.display()))
        })
    }
}
