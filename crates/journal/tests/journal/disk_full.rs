//! A disk that takes no more, in the form of a limit on the size of files: part of a write succeeds,
//! the rest is refused.

use std::fs;
use std::path::{Path, PathBuf};

use journal::{Journal, WriteError};
use nix::sys::resource::{Resource, getrlimit, setrlimit};
use nix::sys::signal::{SigSet, Signal};

use crate::child::{self, Process};
use crate::support::{open, present, read};

#[test]
fn a_full_disk_refuses_records_and_harms_none() {
    let directory = tempfile::tempdir().unwrap();
    // The limit is the whole process's, so it is not this one's.
    let mut writer = Process::start("disk_full::writes_to_the_limit_as_a_child", directory.path());
    let reported: Vec<String> = writer.reported.by_ref().map(Result::unwrap).collect();
    assert!(writer.child.wait().unwrap().success(), "{}", reported.join("\n"));
    assert_eq!(reported, ["done"]);
    let opened = open(directory.path());
    assert_eq!(opened.damage, []);
    assert_eq!(opened.records.last().unwrap(), "after the limit");
}

#[test]
#[ignore = "the child of another test"]
fn writes_to_the_limit_as_a_child() {
    let directory = child::directory();
    // A process that exceeds the limit is killed by a signal, unless it is blocked.
    let mut blocked = SigSet::empty();
    blocked.add(Signal::SIGXFSZ);
    blocked.thread_block().unwrap();

    let mut journal = open(&directory).journal;
    journal.append_all((0..10).map(|number| format!("record {number}"))).unwrap();
    for room in 0..40 {
        limit(journal.bytes() + room);
        is_refused(&mut journal, &directory);
    }
    lift_limit();
    journal.append("after the limit").unwrap();
    journal.rotate(["snapshot", "after the limit"]).unwrap();
    assert_eq!(read(&directory).len(), 13);
    child::tell("done");
}

fn is_refused(journal: &mut Journal, directory: &Path) {
    let (records, bytes) = (read(directory), journal.bytes());
    let unharmed = |journal: &Journal| {
        assert_eq!(journal.bytes(), bytes);
        assert_eq!(fs::metadata(present(directory)).unwrap().len(), bytes);
        assert_eq!(read(directory), records);
    };
    let record = "0123456789".repeat(5);
    assert_eq!(refused(journal.append(&record)), present(directory));
    unharmed(journal);
    assert_eq!(refused(journal.append_all(["short", &record])), present(directory));
    unharmed(journal);
    let next = directory.join("journal.new");
    assert_eq!(refused(journal.rotate(["x".repeat(4000)])), next);
    assert!(!next.exists());
    unharmed(journal);
}

/// The file that the operating system refused to write.
fn refused(result: Result<(), WriteError>) -> PathBuf {
    match result {
        Err(WriteError::Io(error)) => error.path,
        other => panic!("{other:?}"),
    }
}

fn limit(bytes: u64) {
    let (_, most) = getrlimit(Resource::RLIMIT_FSIZE).unwrap();
    setrlimit(Resource::RLIMIT_FSIZE, bytes, most).unwrap();
}

fn lift_limit() {
    let (_, most) = getrlimit(Resource::RLIMIT_FSIZE).unwrap();
    limit(most);
}
