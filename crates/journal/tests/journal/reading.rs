//! Reading without the lock while another handle writes.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use crate::support::{open, read};

/// Long enough for some hundred rotations.
const DURATION: Duration = Duration::from_secs(2);
/// How often each reader reads at least, however long that takes.
const READS: u64 = 10;

/// Says its number at both ends and has a length that only this number has.
fn record(number: u64) -> String {
    format!("{number} {} {number}", "x".repeat((number * 7919 % 4000) as usize))
}

/// The numbers of the records, which are the right ones in the right order. Snapshots have none.
fn numbers(records: &[String]) -> Vec<u64> {
    let numbered = records.iter().filter(|record| *record != "snapshot");
    let numbers: Vec<u64> = numbered
        .map(|text| {
            let number = text.split(' ').next().unwrap().parse().unwrap();
            assert_eq!(*text, record(number), "a wrong record");
            number
        })
        .collect();
    assert!(numbers.windows(2).all(|pair| pair[0] + 1 == pair[1]), "missing or twice: {numbers:?}");
    numbers
}

/// Writes for a while and until this is so.
fn write(directory: &Path, rotate_every: u64, enough: impl Fn() -> bool) {
    let mut journal = open(directory).journal;
    let start = Instant::now();
    for number in 0.. {
        journal.append(&record(number)).unwrap();
        if number % rotate_every == rotate_every - 1 {
            journal.rotate(["snapshot"]).unwrap();
            if start.elapsed() > DURATION && enough() {
                break;
            }
        }
    }
}

/// Reads until `done`, and counts how often; each time at least what was there the time before.
fn follow(directory: &Path, done: &AtomicBool, reads: &AtomicU64) {
    let mut last = 0;
    while !done.load(Ordering::Relaxed) {
        let numbers = numbers(&read(directory));
        let latest = numbers.last().copied().unwrap_or(0);
        assert!(latest >= last, "{latest} came after {last}");
        last = latest;
        reads.fetch_add(1, Ordering::Relaxed);
    }
}

fn followed(rotate_every: u64) {
    let temporary = tempfile::tempdir().unwrap();
    let directory = temporary.path();
    drop(open(directory));
    let (done, reads) = (AtomicBool::new(false), [const { AtomicU64::new(0) }; 2]);
    thread::scope(|scope| {
        let stop = &done;
        let readers =
            reads.each_ref().map(|reads| scope.spawn(move || follow(directory, stop, reads)));
        // A reader that has failed reads no more, and shows why below.
        let enough = || {
            let have_read = reads.iter().all(|reads| reads.load(Ordering::Relaxed) >= READS);
            have_read || readers.iter().any(thread::ScopedJoinHandle::is_finished)
        };
        let written =
            thread::scope(|scope| scope.spawn(|| write(directory, rotate_every, enough)).join());
        done.store(true, Ordering::Relaxed);
        written.unwrap();
        for reader in readers {
            reader.join().unwrap();
        }
    });
    numbers(&read(directory));
}

#[test]
fn a_concurrent_reader_gets_whole_records_without_gap() {
    followed(1000);
}

#[test]
fn a_rotation_meanwhile_neither_hides_a_file_nor_shows_it_twice() {
    followed(1);
}

#[test]
fn what_is_appended_after_the_reading_began_is_not_read() {
    let directory = tempfile::tempdir().unwrap();
    let mut journal = open(directory.path()).journal;
    journal.append_all(["first", "second"]).unwrap();
    let mut records = journal::read(directory.path()).unwrap();
    assert_eq!(records.next().unwrap().unwrap(), "first");
    journal.append("third").unwrap();
    journal.rotate(["snapshot"]).unwrap();
    journal.rotate(["snapshot"]).unwrap();
    assert_eq!(records.next().unwrap().unwrap(), "second");
    assert!(records.next().is_none());
    assert!(records.next().is_none());
}
