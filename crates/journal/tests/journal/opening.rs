//! What opening creates and what it refuses.

use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use journal::{Journal, MAX_RECORD_BYTES, OpenError, WriteError};

use crate::support::{open, present, read};

fn mode(path: &Path) -> u32 {
    fs::metadata(path).unwrap().permissions().mode() & 0o777
}

#[test]
fn a_new_journal_is_empty_and_for_its_owner_only() {
    let temporary = tempfile::tempdir().unwrap();
    let directory = temporary.path().join("state/module1");
    let mut opened = open(&directory);
    assert_eq!((opened.records.len(), opened.damage.len(), opened.journal.bytes()), (0, 0, 0));
    opened.journal.rotate(["snapshot"]).unwrap();
    for created in [directory.parent().unwrap(), &directory] {
        assert_eq!(mode(created), 0o700);
    }
    for name in ["journal", "journal.old", "lock"] {
        assert_eq!(mode(&directory.join(name)), 0o600, "{name}");
    }
}

#[test]
fn a_relative_directory_is_created_where_it_should_be() {
    // below the package, which is where cargo runs the tests
    let temporary = tempfile::tempdir_in(".").unwrap();
    let directory = Path::new(temporary.path().file_name().unwrap()).join("journal");
    open(&directory).journal.append("record").unwrap();
    assert_eq!(read(&temporary.path().join("journal")), ["record"]);
}

#[test]
fn a_directory_that_is_there_keeps_its_mode_and_its_other_files() {
    let temporary = tempfile::tempdir().unwrap();
    fs::set_permissions(temporary.path(), Permissions::from_mode(0o750)).unwrap();
    fs::write(temporary.path().join("other"), "text").unwrap();
    open(temporary.path()).journal.append("record").unwrap();
    assert_eq!(mode(temporary.path()), 0o750);
    assert_eq!(fs::read(temporary.path().join("other")).unwrap(), b"text");
}

#[test]
fn no_link_is_followed() {
    for name in ["journal", "lock"] {
        let temporary = tempfile::tempdir().unwrap();
        let (elsewhere, directory) =
            (temporary.path().join("other"), temporary.path().join("state"));
        fs::write(&elsewhere, "text").unwrap();
        fs::create_dir(&directory).unwrap();
        std::os::unix::fs::symlink(&elsewhere, directory.join(name)).unwrap();
        let error = Journal::open(&directory).unwrap_err();
        assert!(matches!(&error, OpenError::Io(e) if e.path == directory.join(name)), "{error}");
        assert_eq!(fs::read(&elsewhere).unwrap(), b"text", "{name}");
    }
}

#[test]
fn a_file_in_place_of_the_directory_is_refused_by_name() {
    let temporary = tempfile::tempdir().unwrap();
    let file = temporary.path().join("file");
    fs::write(&file, "text").unwrap();
    let error = Journal::open(&file).unwrap_err();
    assert!(matches!(&error, OpenError::NotADirectory { path } if *path == file), "{error}");
    let error = journal::read(&file).unwrap_err();
    assert!(matches!(&error, OpenError::NotADirectory { path } if *path == file), "{error}");
    let below = file.join("journal");
    let error = Journal::open(&below).unwrap_err();
    assert!(matches!(&error, OpenError::Io(error) if error.path == below), "{error}");
    assert_eq!(fs::read(&file).unwrap(), b"text");
}

/// A directory that takes no files.
fn unwritable(temporary: &Path) -> PathBuf {
    fs::set_permissions(temporary, Permissions::from_mode(0o500)).unwrap();
    match fs::write(temporary.join("try"), "") {
        // the super-user may write everywhere but there
        Ok(()) => PathBuf::from("/proc"),
        Err(_) => temporary.to_owned(),
    }
}

#[test]
fn a_directory_that_may_not_be_written_is_refused_by_name() {
    let temporary = tempfile::tempdir().unwrap();
    let directory = unwritable(temporary.path());
    let error = Journal::open(&directory).unwrap_err();
    assert!(matches!(&error, OpenError::Io(error) if error.path.starts_with(&directory)));
    assert!(error.to_string().contains(directory.to_str().unwrap()), "{error}");
}

#[test]
fn a_directory_in_place_of_the_file_is_refused_by_name() {
    let temporary = tempfile::tempdir().unwrap();
    fs::create_dir(present(temporary.path())).unwrap();
    let error = Journal::open(temporary.path()).unwrap_err();
    let path = present(temporary.path());
    assert!(matches!(&error, OpenError::Io(error) if error.path == path), "{error}");
}

#[test]
fn reading_creates_nothing() {
    let temporary = tempfile::tempdir().unwrap();
    assert!(read(temporary.path()).is_empty());
    assert_eq!(fs::read_dir(temporary.path()).unwrap().count(), 0);
    let missing = temporary.path().join("missing");
    let error = journal::read(&missing).unwrap_err();
    assert!(matches!(&error, OpenError::Io(error) if error.path == missing), "{error}");
}

#[test]
fn a_batch_with_a_record_that_is_refused_writes_nothing() {
    let temporary = tempfile::tempdir().unwrap();
    let mut journal = open(temporary.path()).journal;
    let longest = "x".repeat(MAX_RECORD_BYTES);
    journal.append(&longest).unwrap();
    let before = journal.bytes();
    let error = journal.append_all(["good", "two\nlines"]).unwrap_err();
    assert!(matches!(error, WriteError::Newline { at: 3 }), "{error}");
    let error = journal.rotate(["good", &format!("{longest}x")]).unwrap_err();
    assert!(matches!(error, WriteError::TooLong { .. }), "{error}");
    assert_eq!(journal.bytes(), before);
    assert_eq!(read(temporary.path()), [longest]);
}
