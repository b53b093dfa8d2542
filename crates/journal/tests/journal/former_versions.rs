//! A journal that version 0.1.0 wrote, rotated once and torn at its end, is read by every later one.

use std::path::Path;

use crate::support::{open, read};

#[test]
fn a_journal_of_version_0_1_0_comes_back_up_to_the_torn_record() {
    let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/journal-0.1.0");
    let directory = tempfile::tempdir().unwrap();
    for file in std::fs::read_dir(kept).unwrap() {
        let file = file.unwrap();
        std::fs::copy(file.path(), directory.path().join(file.file_name())).unwrap();
    }
    let all = ["one", "two with µ and ✓", "three", "snapshot: three", "four", "five"];
    let opened = open(directory.path());
    assert_eq!(opened.records, all);
    assert_eq!(opened.damage.len(), 1);
    assert_eq!(read(directory.path()), all);
}
