//! Reading without the lock while another handle writes.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use crate::support::{open, read};

/// Long enough for some hundred rotations.
const DURATION: Duration = Duration::from_secs(2);

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

fn write(directory: &Path, rotate_every: u64) {
    let mut journal = open(directory).journal;
    let start = Instant::now();
    for number in 0.. {
        journal.append(&record(number)).unwrap();
        if number % rotate_every == rotate_every - 1 {
            journal.rotate(["snapshot"]).unwrap();
            if start.elapsed() > DURATION {
                break;
            }
        }
    }
}

/// Reads until `done`; each time at least what was there the time before. Returns how often.
fn follow(directory: &Path, done: &AtomicBool) -> u64 {
    let mut reads = 0;
    let mut last = 0;
    while !done.load(Ordering::Relaxed) {
        let numbers = numbers(&read(directory));
        let latest = numbers.last().copied().unwrap_or(0);
        assert!(latest >= last, "{latest} came after {last}");
        last = latest;
        reads += 1;
    }
    reads
}

fn followed(rotate_every: u64) {
    let temporary = tempfile::tempdir().unwrap();
    let directory = temporary.path();
    drop(open(directory));
    let done = AtomicBool::new(false);
    thread::scope(|scope| {
        let readers = [(); 2].map(|()| scope.spawn(|| follow(directory, &done)));
        let written = scope.spawn(|| write(directory, rotate_every)).join();
        done.store(true, Ordering::Relaxed);
        written.unwrap();
        for reader in readers {
            assert!(reader.join().unwrap() > 10);
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
