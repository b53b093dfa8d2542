//! The output directory. Existing files are never overwritten, and a command that fails leaves nothing behind.

use std::fs;
use std::path::{Path, PathBuf};

use crate::failure::Failure;

pub(crate) struct Directory {
    path: PathBuf,
    /// The directories that were created for it, innermost first.
    created: Vec<PathBuf>,
    is_kept: bool,
}

impl Directory {
    /// Claims a directory that does not exist or is empty. Its content is removed unless it is kept.
    pub(crate) fn claim(path: &Path) -> Result<Directory, Failure> {
        let unusable = |error: std::io::Error| {
            Failure::runtime(format!("cannot use `{}` as a directory: {error}", path.display()))
        };
        let is_missing = |folder: &&Path| !folder.as_os_str().is_empty() && !folder.exists();
        let created = path.ancestors().take_while(is_missing).map(Path::to_owned).collect();
        fs::create_dir_all(path).map_err(unusable)?;
        if fs::read_dir(path).map_err(unusable)?.next().is_some() {
            return Err(Failure::runtime(format!(
                "`{}` has files in it, which are left as they are; name a new directory",
                path.display()
            )));
        }
        Ok(Directory { path: path.to_owned(), created, is_kept: false })
    }

    /// Writes a file, given its path in the directory.
    pub(crate) fn write(&self, file: &str, text: &str) -> Result<(), Failure> {
        let path = self.path.join(file);
        let folder = path.parent().unwrap_or(&self.path);
        fs::create_dir_all(folder).and_then(|()| fs::write(&path, text)).map_err(|error| {
            Failure::runtime(format!("cannot write `{}`: {error}", path.display()))
        })
    }

    /// Keeps the files: they are complete.
    pub(crate) fn keep(mut self) {
        self.is_kept = true;
    }
}

impl Drop for Directory {
    fn drop(&mut self) {
        if self.is_kept {
            return;
        }
        // The command fails already; what cannot be removed stays.
        for entry in fs::read_dir(&self.path).into_iter().flatten().flatten() {
            let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
            let remove = if is_folder { fs::remove_dir_all } else { fs::remove_file };
            let _ = remove(entry.path());
        }
        for folder in &self.created {
            let _ = fs::remove_dir(folder);
        }
    }
}
