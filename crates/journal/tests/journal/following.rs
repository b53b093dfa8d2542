//! Reading on from where reading ended before.

use std::fs::OpenOptions;
use std::path::Path;

use journal::{JournalFollower, RecordPlace};

use crate::support::{open, present, read};

/// What a follower has of a journal.
pub(crate) struct Followed {
    follower: JournalFollower,
    records: Vec<(RecordPlace, String)>,
    /// Records read, again ones included.
    pub(crate) read: usize,
}

impl Followed {
    pub(crate) fn new(directory: &Path) -> Self {
        Self { follower: JournalFollower::new(directory), records: Vec::new(), read: 0 }
    }

    /// What it has after another look, each record read once more at its place.
    pub(crate) fn records(&mut self) -> Vec<String> {
        let mut look = self.follower.look().unwrap();
        if look.is_anew() {
            self.records.clear();
        }
        while let Some(record) = look.next_record().unwrap() {
            self.read += 1;
            self.records.push(record);
        }
        let again = |(place, text): &(RecordPlace, String)| {
            let record = look.record_at(*place).unwrap().unwrap();
            assert_eq!(record, *text);
            record
        };
        self.records.iter().map(again).collect()
    }
}

#[test]
fn only_what_is_new_is_read_until_the_files_are_others() {
    let directory = tempfile::tempdir().unwrap();
    let mut journal = open(directory.path()).journal;
    let mut followed = Followed::new(directory.path());
    let mut expected = Vec::new();
    for round in 0..10 {
        let records = [format!("{round}"), "x".repeat(round * 1000)];
        journal.append_all(&records).unwrap();
        expected.extend(records);
        assert_eq!(followed.records(), expected);
        assert_eq!(followed.read, expected.len());
    }
    journal.rotate(["snapshot"]).unwrap();
    expected.push("snapshot".to_owned());
    assert_eq!(followed.records(), expected);
    assert_eq!(followed.read, 20 + 21);
    journal.append("last").unwrap();
    expected.push("last".to_owned());
    assert_eq!(followed.records(), expected);
    assert_eq!(followed.read, 20 + 22);
}

#[test]
fn what_was_cut_off_after_it_had_been_read_is_no_more() {
    let directory = tempfile::tempdir().unwrap();
    let mut journal = open(directory.path()).journal;
    journal.append("first").unwrap();
    let length = journal.bytes();
    let cut = || {
        let file = OpenOptions::new().write(true).open(present(directory.path())).unwrap();
        file.set_len(length).unwrap();
    };
    let mut followed = Followed::new(directory.path());
    for replacement in ["other", "of another length", ""] {
        journal.append("again").unwrap();
        assert_eq!(followed.records(), ["first", "again"]);
        cut();
        assert_eq!(followed.records(), ["first"]);
        journal.append("again").unwrap();
        assert_eq!(followed.records(), ["first", "again"]);
        cut();
        journal.append_all([replacement, "more"]).unwrap();
        assert_eq!(followed.records(), ["first", replacement, "more"]);
        cut();
        assert_eq!(followed.records(), read(directory.path()));
    }
}

#[test]
fn a_record_that_is_gone_or_damaged_is_none_at_its_place() {
    let directory = tempfile::tempdir().unwrap();
    let mut journal = open(directory.path()).journal;
    journal.append_all(["first", "second"]).unwrap();
    let mut follower = JournalFollower::new(directory.path());
    let mut look = follower.look().unwrap();
    let (first, _) = look.next_record().unwrap().unwrap();
    let (second, _) = look.next_record().unwrap().unwrap();
    let path = present(directory.path());
    let damaged = std::fs::read_to_string(&path).unwrap().replace("first", "fIrst");
    std::fs::write(&path, &damaged[..damaged.len() - 1]).unwrap();
    assert_eq!(look.record_at(first).unwrap(), None);
    assert_eq!(look.record_at(second).unwrap(), None);
}

#[test]
fn places_hold_through_rotations_for_as_long_as_the_look_lasts() {
    let directory = tempfile::tempdir().unwrap();
    let mut journal = open(directory.path()).journal;
    journal.append("first").unwrap();
    let mut follower = JournalFollower::new(directory.path());
    let mut look = follower.look().unwrap();
    let (place, _) = look.next_record().unwrap().unwrap();
    for _ in 0..3 {
        journal.rotate(["snapshot"]).unwrap();
    }
    assert_eq!(look.record_at(place).unwrap().as_deref(), Some("first"));
}

#[test]
fn a_look_that_was_not_read_to_its_end_is_continued_by_the_next_one() {
    let directory = tempfile::tempdir().unwrap();
    let mut journal = open(directory.path()).journal;
    journal.append_all(["first", "second"]).unwrap();
    journal.rotate(["snapshot"]).unwrap();
    let mut follower = JournalFollower::new(directory.path());
    let mut records = Vec::new();
    for _ in 0..4 {
        records.extend(follower.look().unwrap().next_record().unwrap().map(|(_, record)| record));
    }
    assert_eq!(records, ["first", "second", "snapshot"]);
}
