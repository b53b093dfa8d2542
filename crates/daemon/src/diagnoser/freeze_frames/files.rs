//! The files of freeze frames: `freeze-frames/{incarnation}-{sequence}.json` in the state directory, each a message. They
//! are written under another name first, so that a file is whole or not there.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use vocabulary::{FreezeFrame, MAX_MESSAGE_BYTES};

const FOLDER: &str = "freeze-frames";
const ENDING: &str = "json";
/// What a file is called while it is written.
const UNFINISHED: &str = "unfinished";

/// The folder, which is made when the first file is written.
#[derive(Debug)]
pub(super) struct FreezeFrameFiles(PathBuf);

/// A file that was there at the start.
#[derive(Debug)]
pub(super) struct FoundFrame {
    pub(super) path: PathBuf,
    pub(super) bytes: u64,
    /// What is in it, or why that cannot be used.
    pub(super) frame: Result<FreezeFrame, String>,
}

impl FreezeFrameFiles {
    /// That of a state directory.
    pub(super) fn of(state: &Path) -> Self {
        Self(state.join(FOLDER))
    }

    /// Every file there is, in the order of their names. What was being written when a process ended is removed.
    ///
    /// # Errors
    /// The folder cannot be read; a missing folder is not an error.
    pub(super) fn read(&self) -> io::Result<Vec<FoundFrame>> {
        let entries = match fs::read_dir(&self.0) {
            Ok(entries) => entries,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(error) => return Err(error),
        };
        let mut paths = entries.map(|entry| Ok(entry?.path())).collect::<io::Result<Vec<_>>>()?;
        paths.sort();
        let ends_in = |path: &Path, ending| path.extension().is_some_and(|own| own == ending);
        for leftover in paths.iter().filter(|path| ends_in(path, UNFINISHED)) {
            if let Err(error) = fs::remove_file(leftover) {
                tracing::debug!(file = %leftover.display(), "not removed: {error}");
            }
        }
        Ok(paths.into_iter().filter(|path| ends_in(path, ENDING)).map(found).collect())
    }

    /// Writes a frame; its file and how long that is.
    ///
    /// # Errors
    /// It cannot be written; an incomplete file does not count as a frame.
    pub(super) fn write(&self, frame: &FreezeFrame) -> io::Result<(PathBuf, u64)> {
        let bytes = vocabulary::encode(frame).map_err(io::Error::other)?;
        fs::create_dir_all(&self.0)?;
        let path = self.0.join(name(frame));
        let unfinished = path.with_extension(UNFINISHED);
        let mut options = journal::state_file();
        let mut file = options.write(true).create(true).truncate(true).open(&unfinished)?;
        file.write_all(&bytes)?;
        file.sync_all()?;
        fs::rename(&unfinished, &path)?;
        File::open(&self.0)?.sync_all()?;
        Ok((path, bytes.len() as u64))
    }
}

/// Numbers of another journal mean something else, so the incarnation is part of the name.
fn name(frame: &FreezeFrame) -> String {
    format!("{:016x}-{:020}.{ENDING}", frame.incarnation, frame.signals.sequence)
}

fn found(path: PathBuf) -> FoundFrame {
    let bytes = fs::metadata(&path).map_or(0, |metadata| metadata.len());
    let frame = read(&path);
    FoundFrame { path, bytes, frame }
}

/// Reads a frame.
///
/// # Errors
/// The file cannot be read, or is not a freeze frame.
pub(super) fn read(path: &Path) -> Result<FreezeFrame, String> {
    let length = fs::metadata(path).map_err(|error| error.to_string())?.len();
    if length > MAX_MESSAGE_BYTES as u64 {
        return Err(format!("file too large: {length} bytes"));
    }
    let bytes = fs::read(path).map_err(|error| error.to_string())?;
    vocabulary::decode(&bytes).map_err(|error| error.to_string())
}
