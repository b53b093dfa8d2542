//! Whatever is done to a journal, it holds what a plain list would hold.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::Path;

use journal::{DamageKind, Journal};
use proptest::collection::vec;
use proptest::prelude::*;

use crate::following::Followed;
use crate::support::{open, present, read};

#[derive(Debug, Clone)]
enum Act {
    Append(Vec<String>),
    Sync,
    Rotate(Vec<String>),
    /// The process ends in order.
    Reopen,
    /// The process ends within a write, which leaves this behind.
    Crash(Vec<u8>),
}

fn record() -> impl Strategy<Value = String> {
    prop_oneof!["[^\n]{0,200}", "[ -~]{0,20}", "[0-9a-f]{8} [0-9a-f]{0,8}"]
}

fn act() -> impl Strategy<Value = Act> {
    let garbage = prop_oneof![
        vec(any::<u8>().prop_filter("no newline", |&byte| byte != b'\n'), 1..100),
        (1..10_000_usize).prop_map(|length| vec![0; length]),
    ];
    prop_oneof![
        5 => vec(record(), 0..5).prop_map(Act::Append),
        1 => Just(Act::Sync),
        1 => vec(record(), 0..4).prop_map(Act::Rotate),
        1 => Just(Act::Reopen),
        1 => garbage.prop_map(Act::Crash),
    ]
}

/// What the journal should hold.
#[derive(Default)]
struct Model {
    older: Vec<String>,
    present: Vec<String>,
}

impl Model {
    fn records(&self) -> Vec<String> {
        [&self.older[..], &self.present[..]].concat()
    }
}

fn perform(act: Act, directory: &Path, journal: Journal, model: &mut Model) -> Journal {
    let mut journal = journal;
    match act {
        Act::Append(records) => {
            journal.append_all(&records).unwrap();
            model.present.extend(records);
        }
        Act::Sync => journal.sync().unwrap(),
        Act::Rotate(snapshot) => {
            journal.rotate(&snapshot).unwrap();
            model.older = std::mem::replace(&mut model.present, snapshot);
        }
        Act::Reopen => {
            drop(journal);
            return reopen(directory, model, 0);
        }
        Act::Crash(garbage) => {
            drop(journal);
            let mut file = OpenOptions::new().append(true).open(present(directory)).unwrap();
            file.write_all(&garbage).unwrap();
            assert_eq!(read(directory), model.records());
            return reopen(directory, model, garbage.len() as u64);
        }
    }
    journal
}

fn reopen(directory: &Path, model: &Model, torn: u64) -> Journal {
    let opened = open(directory);
    assert_eq!(opened.records, model.records());
    let bytes: u64 = opened.damage.iter().map(|damage| damage.bytes).sum();
    assert_eq!(bytes, torn);
    assert!(opened.damage.iter().all(|damage| damage.kind == DamageKind::TornTail));
    opened.journal
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn a_journal_holds_what_was_appended(acts in vec(act(), 0..20)) {
        let directory = tempfile::tempdir().unwrap();
        let mut journal = open(directory.path()).journal;
        let mut model = Model::default();
        let mut followed = Followed::new(directory.path());
        for act in acts {
            journal = perform(act, directory.path(), journal, &mut model);
            let length = fs::metadata(present(directory.path())).unwrap().len();
            prop_assert_eq!(journal.bytes(), length);
            prop_assert_eq!(read(directory.path()), model.records());
            prop_assert_eq!(followed.records(), model.records());
        }
    }

    #[test]
    fn a_journal_opens_whatever_its_files_contain(
        older in vec(any::<u8>(), 0..300),
        bytes in vec(prop_oneof![any::<u8>(), Just(b'\n')], 0..300),
        next in vec(any::<u8>(), 0..300),
    ) {
        let directory = tempfile::tempdir().unwrap();
        fs::write(directory.path().join("journal.old"), &older).unwrap();
        fs::write(directory.path().join("journal.new"), &next).unwrap();
        fs::write(present(directory.path()), &bytes).unwrap();
        let opened = open(directory.path());
        prop_assert_eq!(&opened.records, &Vec::<String>::new());
        let damaged: u64 = opened.damage.iter().map(|damage| damage.bytes).sum();
        prop_assert_eq!(damaged, (older.len() + bytes.len()) as u64);
        let mut journal = opened.journal;
        journal.append("record").unwrap();
        drop(journal);
        prop_assert_eq!(open(directory.path()).records, ["record"]);
    }
}
