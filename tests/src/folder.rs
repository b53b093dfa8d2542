//! Temporary folders.

use tempfile::TempDir;

/// In memory where the machine has a file system there, so that a disk that something else keeps busy is no
/// disturbance of its own: each process waits for its journal, and a killed one ends only when the disk has
/// answered. What survives a killed process survives there as well.
#[must_use]
pub fn temporary() -> TempDir {
    tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).unwrap()
}
