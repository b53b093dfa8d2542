//! One writer at a time.

use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use journal::{Journal, OpenError};

use crate::child::{self, Process};
use crate::support::{open, read};

fn is_in_use_by(directory: &Path, pid: u32) {
    let error = Journal::open(directory).unwrap_err();
    let text = error.to_string();
    assert!(
        text.contains(directory.to_str().unwrap()) && text.contains(&pid.to_string()),
        "{text}"
    );
    let OpenError::InUse { directory: named, holder } = error else { panic!("{error}") };
    assert_eq!((named.as_path(), holder), (directory, Some(pid)));
}

#[test]
fn a_second_handle_in_the_same_process_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let mut opened = open(directory.path());
    is_in_use_by(directory.path(), std::process::id());
    opened.journal.append("record").unwrap();
    // reading needs no lock
    assert_eq!(read(directory.path()), ["record"]);
    drop(opened);
    assert_eq!(open(directory.path()).records, ["record"]);
}

#[test]
fn another_process_is_refused_until_the_holder_is_killed() {
    let directory = tempfile::tempdir().unwrap();
    for _ in 0..5 {
        let mut holder = Process::start("lock::holds_the_journal_as_a_child", directory.path());
        assert_eq!(holder.hear(), "holding");
        is_in_use_by(directory.path(), holder.child.id());
        holder.kill();
        drop(open(directory.path()));
    }
    assert_eq!(read(directory.path()).len(), 5);
}

#[test]
fn a_lock_without_a_holder_name_is_in_use_all_the_same() {
    let directory = tempfile::tempdir().unwrap();
    let opened = open(directory.path());
    for text in ["", "nonsense", "99999999999"] {
        std::fs::write(directory.path().join("lock"), text).unwrap();
        let error = Journal::open(directory.path()).unwrap_err();
        assert!(matches!(error, OpenError::InUse { holder: None, .. }), "{error}");
        assert!(error.to_string().contains("another process"), "{error}");
    }
    drop(opened);
    open(directory.path());
}

#[test]
fn a_process_being_started_does_not_keep_the_lock() {
    let directory = tempfile::tempdir().unwrap();
    let done = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| {
            while !done.load(Ordering::Relaxed) {
                // until it becomes another program, it has all files open that this one has
                Command::new("true").status().unwrap();
            }
        });
        let refused = (0..200).find_map(|_| Journal::open(directory.path()).err());
        done.store(true, Ordering::Relaxed);
        assert!(refused.is_none(), "{refused:?}");
    });
}

#[test]
#[ignore = "the child of another test"]
fn holds_the_journal_as_a_child() {
    let directory = child::directory();
    let mut journal = open(&directory).journal;
    journal.append("held").unwrap();
    child::tell("holding");
    loop {
        thread::park();
    }
}
