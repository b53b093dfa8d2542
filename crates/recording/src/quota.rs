//! Limits the total length of all recordings in a directory: the oldest are deleted first.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

/// The part after the name in `{name}-20261126T042500Z-0001.mcap`; `#` is a digit.
const FORM: &str = "-########T######Z-####.mcap";

/// The name of a file that begins now \[ns since 1970\]. Names sort by time.
pub(crate) fn file_name(name: &str, now_unix_ns: u64, number: u32) -> String {
    let time = std::time::UNIX_EPOCH + std::time::Duration::from_nanos(now_unix_ns);
    let time = humantime::format_rfc3339_seconds(time).to_string().replace(['-', ':'], "");
    format!("{name}-{time}-{number:04}.mcap")
}

fn is_ours(name: &str, file: &str) -> bool {
    let fits = |(found, wanted): (u8, u8)| match wanted {
        b'#' => found.is_ascii_digit(),
        _ => found == wanted,
    };
    file.strip_prefix(name)
        .is_some_and(|rest| rest.len() == FORM.len() && rest.bytes().zip(FORM.bytes()).all(fits))
}

/// Recordings with this name and their lengths \[bytes\], oldest first: those of earlier recorders by name, then those
/// that this one has `begun`, in that order, because the clock may have been set back.
fn recordings(directory: &Path, name: &str, begun: &[PathBuf]) -> io::Result<Vec<(PathBuf, u64)>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(directory)? {
        let entry = entry?;
        let ours = entry.file_name().to_str().is_some_and(|file| is_ours(name, file));
        let metadata = entry.metadata()?;
        if ours && metadata.is_file() {
            found.push((entry.path(), metadata.len()));
        }
    }
    let place = |file: &PathBuf| begun.iter().position(|known| known == file);
    found.sort_by_cached_key(|(file, _)| (place(file), file.clone()));
    Ok(found)
}

/// Deletes the oldest recordings with this name that are not being written, until the rest is within the quota
/// \[bytes\]. This recorder has `begun` some of them. Returns the deleted files.
pub(crate) fn keep(
    directory: &Path,
    name: &str,
    quota: u64,
    begun: &[PathBuf],
) -> io::Result<Vec<PathBuf>> {
    let recordings = recordings(directory, name, begun)?;
    let mut total: u64 = recordings.iter().map(|(_, length)| length).sum();
    let mut deleted = Vec::new();
    for (file, length) in recordings {
        if total <= quota {
            break;
        }
        if is_being_written(&file) {
            continue;
        }
        fs::remove_file(&file)?;
        total -= length;
        deleted.push(file);
    }
    Ok(deleted)
}

/// The recorder that writes a file holds its lock.
fn is_being_written(file: &Path) -> bool {
    let lock = File::open(file).map(|file| file.try_lock());
    matches!(lock, Ok(Err(fs::TryLockError::WouldBlock)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn after_a_clock_set_back_the_newest_stay() {
        let directory = tempfile::tempdir().unwrap();
        let file = |time_unix_s: u64, number| {
            let file = directory.path().join(file_name("t", time_unix_s * 1_000_000_000, number));
            fs::write(&file, [0; 100]).unwrap();
            file
        };
        let (earlier, first, set_back) = (file(5000, 1), file(9000, 1), file(2000, 2));
        let begun = [first.clone(), set_back.clone()];
        let keep = |quota| keep(directory.path(), "t", quota, &begun).unwrap();
        assert_eq!(keep(200), [earlier]);
        assert_eq!(keep(100), [first]);
        assert!(set_back.exists());
    }

    #[test]
    fn names_sort_by_time_and_are_told_from_others() {
        let name = file_name("tower", 1_795_667_100_000_000_000, 1);
        assert_eq!(name, "tower-20261126T042500Z-0001.mcap");
        assert!(is_ours("tower", &name) && !is_ours("tow", &name) && !is_ours("tower-2", &name));
        assert!(!is_ours("tower", "tower-20261126T042500Z-0001.mcap.recovered"));
        assert!(!is_ours("tower", "tower.mcap") && !is_ours("tower", "notes.txt"));
        assert!(file_name("tower", 1_795_667_101_000_000_000, 1) > name);
    }
}
