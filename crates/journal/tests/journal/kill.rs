//! Processes killed while they write: what was reported as synced is on the disk.

use std::path::Path;
use std::thread;
use std::time::Duration;

use journal::Journal;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::child::{self, Process};
use crate::support::{open, read};

const KILLS: u64 = 50;

/// Lets `test` write and kills it some time after its first word. Returns the last number it reported.
fn write_and_kill(test: &str, directory: &Path, random: &mut ChaCha8Rng) -> u64 {
    let mut writer = Process::start(test, directory);
    let mut last = writer.hear();
    thread::sleep(Duration::from_micros(random.random_range(0..30_000)));
    writer.kill();
    // Each line came in a single small write, so the last one is whole.
    for line in writer.reported.by_ref() {
        last = line.unwrap();
    }
    last.parse().unwrap()
}

fn number(record: &str) -> u64 {
    record.split_once(' ').unwrap().0.parse().unwrap()
}

/// A record of a usual length.
fn numbered(number: u64) -> String {
    format!("{number} {}", "x".repeat(100 + (number * 37 % 3900) as usize))
}

#[test]
fn every_record_that_was_synced_survives_the_kill() {
    let directory = tempfile::tempdir().unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(20_261_121);
    for _ in 0..KILLS {
        let synced =
            write_and_kill("kill::appends_and_syncs_as_a_child", directory.path(), &mut random);
        let unlocked = read(directory.path());
        let opened = open(directory.path());
        assert_eq!(opened.records, unlocked);
        assert!(opened.damage.len() <= 1, "{:?}", opened.damage);
        let count = opened.records.len() as u64;
        assert!(count > synced, "{synced} was synced, but there are only {count} records");
        for (k, record) in opened.records.iter().enumerate() {
            assert_eq!(*record, numbered(k as u64));
        }
    }
}

#[test]
#[ignore = "the child of another test"]
fn appends_and_syncs_as_a_child() {
    let directory = child::directory();
    let opened = open(&directory);
    let mut journal = opened.journal;
    for number in opened.records.len() as u64.. {
        journal.append(&numbered(number)).unwrap();
        journal.sync().unwrap();
        child::tell(&number.to_string());
    }
}

/// The number that the state stands at: the latest snapshot's and the records after it, which must
/// follow one another.
fn state(records: &[String]) -> u64 {
    let mut state = None;
    for record in records {
        let number = number(record);
        if record.ends_with("snapshot") {
            assert!(state.is_none_or(|state| state == number), "a snapshot of another state");
        } else {
            assert!(state.is_none_or(|state| state + 1 == number), "a record is missing");
        }
        state = Some(number);
    }
    state.unwrap_or(0)
}

#[test]
fn the_state_survives_a_kill_in_a_rotation() {
    let directory = tempfile::tempdir().unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(20_261_122);
    for _ in 0..KILLS {
        let synced =
            write_and_kill("kill::appends_and_rotates_as_a_child", directory.path(), &mut random);
        let unlocked = read(directory.path());
        let records = open(directory.path()).records;
        assert_eq!(records, unlocked);
        let state = state(&records);
        assert!(state >= synced, "{synced} was synced, but the state is {state}");
    }
}

#[test]
#[ignore = "the child of another test"]
fn appends_and_rotates_as_a_child() {
    let directory = child::directory();
    let opened = open(&directory);
    let mut journal = opened.journal;
    for next in state(&opened.records) + 1.. {
        journal.append(&numbered(next)).unwrap();
        if next % 3 == 0 {
            rotate(&mut journal, next);
        } else {
            journal.sync().unwrap();
        }
        child::tell(&next.to_string());
    }
}

fn rotate(journal: &mut Journal, state: u64) {
    journal.rotate([format!("{state} {} snapshot", "x".repeat(5000))]).unwrap();
}
