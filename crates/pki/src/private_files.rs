//! Writes files readable by the owner only, without overwriting existing ones.

use std::fs::{self, File, OpenOptions, Permissions};
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt, PermissionsExt};
use std::path::Path;

/// Access for the owner only.
const DIRECTORY: u32 = 0o700;
/// Readable by the owner only.
pub(crate) const PRIVATE: u32 = 0o600;
/// Readable by all users with access to the directory.
const PUBLIC: u32 = 0o644;

/// A file of a new directory: its name, its text, and whether it is private.
pub(crate) struct New<'a> {
    pub(crate) name: &'a str,
    pub(crate) text: &'a str,
    pub(crate) private: bool,
}

/// Creates a directory with these files atomically.
///
/// # Errors
/// `AlreadyExists` if the path exists; it is unchanged.
pub(crate) fn make_directory(directory: &Path, files: &[New<'_>]) -> io::Result<()> {
    if directory.symlink_metadata().is_ok() {
        return Err(io::ErrorKind::AlreadyExists.into());
    }
    let parent = parent_of(directory);
    make_private_directory(parent)?;
    let permissions = Permissions::from_mode(DIRECTORY);
    let beside =
        tempfile::Builder::new().prefix(".new-").permissions(permissions).tempdir_in(parent)?;
    for file in files {
        let mode = if file.private { PRIVATE } else { PUBLIC };
        let mut written = OpenOptions::new()
            .write(true)
            .create_new(true)
            .mode(mode)
            .open(beside.path().join(file.name))?;
        written.write_all(file.text.as_bytes())?;
        written.sync_all()?;
    }
    File::open(beside.path())?.sync_all()?;
    // Fails if another process has created a non-empty directory of this name meanwhile.
    fs::rename(beside.path(), directory)?;
    // The directory was renamed, so there is nothing to clean up.
    let _ = beside.keep();
    File::open(parent)?.sync_all()
}

/// Creates a directory accessible to the owner only, unless it exists.
pub(crate) fn make_private_directory(directory: &Path) -> io::Result<()> {
    fs::DirBuilder::new().recursive(true).mode(DIRECTORY).create(directory)
}

/// Replaces a file readable by all users, atomically.
pub(crate) fn replace_public(file: &Path, text: &str) -> io::Result<()> {
    replace(file, text, PUBLIC)
}

/// Likewise for a file readable by the owner only, which may not exist yet.
pub(crate) fn replace_private(file: &Path, text: &str) -> io::Result<()> {
    replace(file, text, PRIVATE)
}

/// Creates a file readable by the owner only, atomically.
///
/// # Errors
/// `AlreadyExists` if the path exists; it is unchanged.
pub(crate) fn create_private(file: &Path, bytes: &[u8]) -> io::Result<()> {
    let parent = parent_of(file);
    let mut beside = tempfile::Builder::new()
        .prefix(".new-")
        .permissions(Permissions::from_mode(PRIVATE))
        .tempfile_in(parent)?;
    beside.write_all(bytes)?;
    beside.as_file().sync_all()?;
    beside.persist_noclobber(file).map_err(|error| error.error)?;
    File::open(parent)?.sync_all()
}

fn replace(file: &Path, text: &str, mode: u32) -> io::Result<()> {
    let parent = parent_of(file);
    let mut beside = tempfile::Builder::new()
        .prefix(".new-")
        .permissions(Permissions::from_mode(mode))
        .tempfile_in(parent)?;
    beside.write_all(text.as_bytes())?;
    beside.as_file().sync_all()?;
    beside.persist(file).map_err(|error| error.error)?;
    File::open(parent)?.sync_all()
}

fn parent_of(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILES: [New<'_>; 2] = [
        New { name: "key.pem", text: "secret", private: true },
        New { name: "certificate.pem", text: "public", private: false },
    ];

    fn mode(path: &Path) -> u32 {
        path.metadata().unwrap().permissions().mode() & 0o777
    }

    #[test]
    fn directories_and_private_files_are_the_owners() {
        let folder = tempfile::tempdir().unwrap();
        let made = folder.path().join("a/b");
        make_directory(&made, &FILES).unwrap();
        assert_eq!(mode(&made), 0o700);
        assert_eq!(mode(made.parent().unwrap()), 0o700);
        assert_eq!(mode(&made.join("key.pem")), 0o600);
        assert_eq!(mode(&made.join("certificate.pem")) & !0o644, 0);
    }

    #[test]
    fn what_is_there_stays_and_nothing_is_left_behind() {
        let folder = tempfile::tempdir().unwrap();
        let made = folder.path().join("a");
        make_directory(&made, &FILES).unwrap();
        fs::write(made.join("key.pem"), "older").unwrap();
        let error = make_directory(&made, &FILES).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(fs::read_to_string(made.join("key.pem")).unwrap(), "older");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_public_file_is_replaced_in_one_piece() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("certificate.pem");
        fs::write(&file, "older").unwrap();
        replace_public(&file, "newer").unwrap();
        assert_eq!(fs::read_to_string(&file).unwrap(), "newer");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(replace_public(&folder.path().join("missing/x.pem"), "x").is_err());
    }
}
