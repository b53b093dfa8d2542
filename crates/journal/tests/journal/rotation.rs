//! A crash between any two steps of a rotation, made by hand: the files as each step leaves them.

use std::fs;
use std::path::Path;

use journal::Opened;

use crate::support::{bytes_of, open, present, read};

const A: [&str; 2] = ["a1", "a2"];
const B: [&str; 3] = ["state a", "b1", "b2"];
const C: [&str; 1] = ["state a and b"];

/// The three files; one that is not given is not there.
fn state(directory: &Path, older: Option<&[u8]>, present: Option<&[u8]>, next: Option<&[u8]>) {
    for (name, bytes) in [("journal.old", older), ("journal", present), ("journal.new", next)] {
        if let Some(bytes) = bytes {
            fs::write(directory.join(name), bytes).unwrap();
        }
    }
}

/// Opens what a crash has left, and sees that it goes on from there: appends, reads, rotates.
fn goes_on(directory: &Path, expected: &[&str]) {
    assert_eq!(read(directory), expected);
    let Opened { mut journal, records, damage } = open(directory);
    assert_eq!(records, expected);
    assert_eq!(damage, []);
    assert!(!directory.join("journal.new").exists());
    assert_eq!(journal.bytes(), fs::metadata(present(directory)).unwrap().len());
    journal.append("after").unwrap();
    assert_eq!(read(directory), [expected, &["after"]].concat());
    journal.rotate(["all"]).unwrap();
    drop(journal);
    let Opened { records, damage, .. } = open(directory);
    assert_eq!(records[records.len() - 2..], ["after", "all"]);
    assert_eq!(damage, []);
}

#[test]
fn before_and_while_the_snapshot_is_written_the_former_files_count() {
    let (a, b, c) = (bytes_of(&A), bytes_of(&B), bytes_of(&C));
    let expected = [&A[..], &B].concat();
    let nothing = std::iter::once(None);
    for next in nothing.chain((0..=c.len()).map(|length| Some(&c[..length]))) {
        let directory = tempfile::tempdir().unwrap();
        state(directory.path(), Some(&a), Some(&b), next);
        goes_on(directory.path(), &expected);
    }
    // the first rotation ever, and a snapshot whose length alone came to the disk
    let directory = tempfile::tempdir().unwrap();
    state(directory.path(), None, Some(&b), Some(&[0; 4096]));
    goes_on(directory.path(), &B);
}

#[test]
fn once_the_former_file_is_the_older_one_the_snapshot_counts() {
    let (b, c) = (bytes_of(&B), bytes_of(&C));
    let directory = tempfile::tempdir().unwrap();
    state(directory.path(), Some(&b), None, Some(&c));
    goes_on(directory.path(), &[&B[..], &C].concat());
}

#[test]
fn a_rotation_that_is_done_leaves_both_files() {
    let (b, c) = (bytes_of(&B), bytes_of(&C));
    let directory = tempfile::tempdir().unwrap();
    state(directory.path(), Some(&b), Some(&c), None);
    goes_on(directory.path(), &[&B[..], &C].concat());
}

#[test]
fn an_empty_snapshot_counts_too() {
    let b = bytes_of(&B);
    let directory = tempfile::tempdir().unwrap();
    state(directory.path(), Some(&b), None, Some(&[]));
    goes_on(directory.path(), &B);
}

#[test]
fn a_present_file_that_is_gone_costs_nothing_of_the_older_one() {
    let a = bytes_of(&A);
    let directory = tempfile::tempdir().unwrap();
    state(directory.path(), Some(&a), None, None);
    goes_on(directory.path(), &A);
}

#[test]
fn the_one_before_the_older_file_goes() {
    let directory = tempfile::tempdir().unwrap();
    let mut journal = open(directory.path()).journal;
    journal.append_all(A).unwrap();
    journal.rotate(["state a"]).unwrap();
    assert_eq!(read(directory.path()), ["a1", "a2", "state a"]);
    journal.append_all(&B[1..]).unwrap();
    journal.rotate(C).unwrap();
    assert_eq!(read(directory.path()), [&B[..], &C].concat());
    assert_eq!(journal.bytes(), bytes_of(&C).len() as u64);
}

#[test]
fn a_rotation_that_is_refused_changes_nothing() {
    let directory = tempfile::tempdir().unwrap();
    let mut journal = open(directory.path()).journal;
    journal.append_all(B).unwrap();
    // nothing can be renamed onto a directory that has something in it
    let obstacle = directory.path().join("journal.old/obstacle");
    fs::create_dir_all(&obstacle).unwrap();
    let before = journal.bytes();
    journal.rotate(C).unwrap_err();
    assert_eq!(journal.bytes(), before);
    assert!(!directory.path().join("journal.new").exists());
    journal.append("after").unwrap();
    fs::remove_dir_all(directory.path().join("journal.old")).unwrap();
    assert_eq!(read(directory.path()), [&B[..], &["after"]].concat());
    journal.rotate(C).unwrap();
    assert_eq!(read(directory.path()), [&B[..], &["after"], &C].concat());
}
