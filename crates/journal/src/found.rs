//! The files of a journal as a reader without the lock finds them.

use std::fs::{self, File};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use crate::error::{FileError, ReadError};
use crate::files::{self, Files};

/// A file, and the path it was found at.
#[derive(Debug)]
pub(crate) struct Found {
    pub(crate) path: PathBuf,
    pub(crate) file: File,
    /// Device and number on it; no other file has them as long as this one is open.
    pub(crate) identity: (u64, u64),
}

/// The older and the present file of the journal in a directory. Each moves on in a rotation, so both are looked for
/// again until they are the same as before; else a whole file could be missed or read twice.
pub(crate) fn both(directory: &Path) -> Result<[Option<Found>; 2], ReadError> {
    let metadata = fs::metadata(directory).map_err(FileError::of("read", directory))?;
    if !metadata.is_dir() {
        return Err(ReadError::NotADirectory { path: directory.to_owned() });
    }
    let files = Files::of(directory);
    loop {
        let present = present(&files)?;
        let older = find(&files.older)?;
        let again = [self::present(&files)?, find(&files.older)?];
        if [identity(&present), identity(&older)] == [identity(&again[0]), identity(&again[1])] {
            return Ok([older, present]);
        }
    }
}

fn identity(found: &Option<Found>) -> Option<(u64, u64)> {
    found.as_ref().map(|found| found.identity)
}

/// The present file, which a rotation leaves without its name for an instant.
fn present(files: &Files) -> Result<Option<Found>, FileError> {
    match find(&files.present)? {
        Some(present) => Ok(Some(present)),
        None => find(&files.next),
    }
}

fn find(path: &Path) -> Result<Option<Found>, FileError> {
    let Some(file) = files::open_if_there(File::options().read(true), path)? else {
        return Ok(None);
    };
    let metadata = file.metadata().map_err(FileError::of("read", path))?;
    let identity = (metadata.dev(), metadata.ino());
    Ok(Some(Found { path: path.to_owned(), file, identity }))
}
