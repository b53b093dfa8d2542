//! Admits one writer at a time.

use std::fs::{File, TryLockError};
use std::io::{Read, Write};

use crate::error::{FileError, OpenError};
use crate::files::{self, JournalFiles};

/// The lock. The operating system releases it when the process ends for any reason.
#[derive(Debug)]
pub(crate) struct Lock {
    file: File,
}

impl Lock {
    /// Acquires the lock, or reports its holder.
    pub(crate) fn acquire(files: &JournalFiles) -> Result<Self, OpenError> {
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
    /// Unlocks explicitly: closing the file is not enough, because a child process that is just starting has it open
    /// too.
    fn drop(&mut self) {
        // After an error, closing the file has to suffice.
        let _ = self.file.unlock();
    }
}

fn holder(file: &mut File) -> Option<u32> {
    let mut text = String::new();
    file.take(16).read_to_string(&mut text).ok()?;
    text.trim().parse().ok()
}

/// Writes the process number, which is used only in messages: a journal must open even on a full disk.
fn sign(file: &mut File) {
    let _ = file.set_len(0).and_then(|()| writeln!(file, "{}", std::process::id()));
}
