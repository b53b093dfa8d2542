//! One writer at a time.

use std::fs::{File, TryLockError};
use std::io::{Read, Write};

use crate::error::{FileError, OpenError};
use crate::files::{self, JournalFiles};

/// The lock, held. The operating system releases it when the process ends, however that ends.
#[derive(Debug)]
pub(crate) struct Lock {
    file: File,
}

impl Lock {
    /// Takes the lock, or reports who has it.
    pub(crate) fn take(files: &JournalFiles) -> Result<Self, OpenError> {
        let mut file =
            files::replacing().open(&files.lock).map_err(FileError::of("open", &files.lock))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let directory = files.directory.clone();
                return Err(OpenError::InUse { directory, holder: holder(&mut file) });
            }
            Err(TryLockError::Error(source)) => {
                return Err(FileError::of("lock", &files.lock)(source).into());
            }
        }
        sign(&mut file);
        Ok(Self { file })
    }
}

impl Drop for Lock {
    /// Closing the file does not do: a child process that is just being started has it open too.
    fn drop(&mut self) {
        // An error leaves it to the closing.
        let _ = self.file.unlock();
    }
}

fn holder(file: &mut File) -> Option<u32> {
    let mut text = String::new();
    file.take(16).read_to_string(&mut text).ok()?;
    text.trim().parse().ok()
}

/// Writes the own process number. It serves a message only: on a full disk a journal must still
/// open.
fn sign(file: &mut File) {
    let _ = file.set_len(0).and_then(|()| writeln!(file, "{}", std::process::id()));
}
