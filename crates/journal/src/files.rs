//! The files of a journal: their paths, durability, and how a reader without the lock opens them.

use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use nix::fcntl::OFlag;

use crate::error::{FileError, OpenError};

/// Access for the owner only.
const DIRECTORY_MODE: u32 = 0o700;
const FILE_MODE: u32 = 0o600;

/// The paths of one journal.
#[derive(Debug)]
pub(crate) struct JournalFiles {
    pub(crate) directory: PathBuf,
    pub(crate) present: PathBuf,
    pub(crate) older: PathBuf,
    pub(crate) next: PathBuf,
    pub(crate) lock: PathBuf,
}

impl JournalFiles {
    pub(crate) fn of(directory: &Path) -> Self {
        Self {
            directory: directory.to_owned(),
            present: directory.join("journal"),
            older: directory.join("journal.old"),
            next: directory.join("journal.new"),
            lock: directory.join("lock"),
        }
    }

    /// Syncs the directory, so that the names of the files are durable.
    pub(crate) fn sync_names(&self) -> Result<(), FileError> {
        sync_directory(&self.directory)
    }
}

/// Creates a directory and its missing parents.
pub(crate) fn create_directory(directory: &Path) -> Result<(), FileError> {
    let missing: Vec<&Path> = directory.ancestors().take_while(|path| !path.exists()).collect();
    DirBuilder::new()
        .recursive(true)
        .mode(DIRECTORY_MODE)
        .create(directory)
        .map_err(FileError::of("create", directory))?;
    for created in missing {
        match created.parent() {
            Some(parent) if parent.as_os_str().is_empty() => sync_directory(Path::new("."))?,
            Some(parent) => sync_directory(parent)?,
            None => {}
        }
    }
    Ok(())
}

fn sync_directory(directory: &Path) -> Result<(), FileError> {
    let synced = File::open(directory).and_then(|directory| directory.sync_all());
    synced.map_err(FileError::of("sync", directory))
}

/// Options of a file in a state directory: only its owner may use it, and no link to another file is followed.
#[must_use]
pub fn state_file() -> OpenOptions {
    let mut options = OpenOptions::new();
    options.read(true).mode(FILE_MODE).custom_flags(OFlag::O_NOFOLLOW.bits());
    options
}

/// Options with which the writer opens the files of a journal: it only appends.
pub(crate) fn appending() -> OpenOptions {
    let mut options = state_file();
    options.append(true);
    options
}

/// Options with which the lock is opened.
pub(crate) fn replacing() -> OpenOptions {
    let mut options = state_file();
    options.write(true).create(true).truncate(false);
    options
}

/// Opens a file that may be missing.
pub(crate) fn open_if_there(options: &OpenOptions, path: &Path) -> Result<Option<File>, FileError> {
    if_there(options.open(path)).map_err(FileError::of("open", path))
}

/// Removes a file that may be missing.
pub(crate) fn remove_if_there(path: &Path) -> Result<(), FileError> {
    if_there(fs::remove_file(path)).map_err(FileError::of("remove", path))?;
    Ok(())
}

pub(crate) fn rename(from: &Path, to: &Path) -> Result<(), FileError> {
    fs::rename(from, to).map_err(FileError::of("rename", from))
}

/// `None` if the error is that the file is missing.
pub(crate) fn if_there<T>(result: io::Result<T>) -> io::Result<Option<T>> {
    match result {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        result => result.map(Some),
    }
}

/// An open file, and its path.
#[derive(Debug)]
pub(crate) struct FoundFile {
    pub(crate) path: PathBuf,
    pub(crate) file: File,
    /// Device and inode number, which are unique as long as the file is open.
    pub(crate) identity: (u64, u64),
}

/// Opens the older and the present file of the journal in a directory. A rotation renames both, so they are opened
/// repeatedly until two attempts agree; otherwise a file could be missed or read twice.
pub(crate) fn both(directory: &Path) -> Result<[Option<FoundFile>; 2], OpenError> {
    let metadata = fs::metadata(directory).map_err(FileError::of("read", directory))?;
    if !metadata.is_dir() {
        return Err(OpenError::NotADirectory { path: directory.to_owned() });
    }
    let files = JournalFiles::of(directory);
    loop {
        let present = present(&files)?;
        let older = find(&files.older)?;
        let again = [self::present(&files)?, find(&files.older)?];
        if [identity(&present), identity(&older)] == [identity(&again[0]), identity(&again[1])] {
            return Ok([older, present]);
        }
    }
}

fn identity(found: &Option<FoundFile>) -> Option<(u64, u64)> {
    found.as_ref().map(|found| found.identity)
}

/// Opens the present file, whose name is missing for an instant during a rotation.
fn present(files: &JournalFiles) -> Result<Option<FoundFile>, FileError> {
    match find(&files.present)? {
        Some(present) => Ok(Some(present)),
        None => find(&files.next),
    }
}

fn find(path: &Path) -> Result<Option<FoundFile>, FileError> {
    let Some(file) = open_if_there(&state_file(), path)? else {
        return Ok(None);
    };
    let metadata = file.metadata().map_err(FileError::of("read", path))?;
    let identity = (metadata.dev(), metadata.ino());
    Ok(Some(FoundFile { path: path.to_owned(), file, identity }))
}
