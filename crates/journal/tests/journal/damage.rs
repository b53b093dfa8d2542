//! A file cut at every byte, and changed at every byte.

use std::fs::{self, File};
use std::os::unix::fs::FileExt;

use journal::{Damage, DamageKind};

use crate::support::{bytes_of, open, present, read};

const RECORDS: [&str; 5] = [r#"{"v":1,"step":17}"#, "", "größer", r#"{"v":1,"step":18}"#, "end"];

/// Where the lines of a file end, newline included.
fn ends(bytes: &[u8]) -> Vec<usize> {
    (0..bytes.len()).filter(|&k| bytes[k] == b'\n').map(|k| k + 1).collect()
}

#[test]
fn a_file_cut_at_any_byte_loses_whole_records_from_its_end() {
    let bytes = bytes_of(&RECORDS);
    let ends = ends(&bytes);
    for length in 0..=bytes.len() {
        let directory = tempfile::tempdir().unwrap();
        let file = present(directory.path());
        fs::write(&file, &bytes[..length]).unwrap();
        let whole = ends.iter().filter(|&&end| end <= length).count();
        let kept = if whole == 0 { 0 } else { ends[whole - 1] };
        assert_eq!(read(directory.path()), &RECORDS[..whole]);

        let mut opened = open(directory.path());
        assert_eq!(opened.records, &RECORDS[..whole]);
        let (offset, torn) = (kept as u64, (length - kept) as u64);
        let damage = Damage { file, offset, bytes: torn, kind: DamageKind::TornTail };
        assert_eq!(opened.damage, Vec::from_iter((torn > 0).then_some(damage)));
        opened.journal.append("after").unwrap();
        drop(opened);

        let opened = open(directory.path());
        assert_eq!(opened.records, [&RECORDS[..whole], &["after"]].concat());
        assert!(opened.damage.is_empty());
    }
}

/// The records that must survive when byte `at` is not what it was. A newline separates two records.
fn survivors(bytes: &[u8], at: usize) -> Vec<&'static str> {
    let line = ends(bytes).iter().filter(|&&end| end <= at).count();
    let lost = if bytes[at] == b'\n' { line..=line + 1 } else { line..=line };
    (0..RECORDS.len()).filter(|k| !lost.contains(k)).map(|k| RECORDS[k]).collect()
}

#[test]
fn a_changed_byte_costs_the_records_it_touches_and_no_other() {
    let bytes = bytes_of(&RECORDS);
    let directory = tempfile::tempdir().unwrap();
    let file = File::create(present(directory.path())).unwrap();
    for at in 0..bytes.len() {
        for flip in 1..=255 {
            let mut changed = bytes.clone();
            changed[at] ^= flip;
            file.write_all_at(&changed, 0).unwrap();
            assert_eq!(read(directory.path()), survivors(&bytes, at), "byte {at} ^ {flip}");
        }
    }
}

#[test]
fn a_changed_byte_is_reported_and_stays_in_the_file() {
    let bytes = bytes_of(&RECORDS);
    for at in 0..bytes.len() {
        let directory = tempfile::tempdir().unwrap();
        let mut changed = bytes.clone();
        changed[at] ^= 1 << (at % 8);
        fs::write(present(directory.path()), &changed).unwrap();
        let mut opened = open(directory.path());
        assert_eq!(opened.records, survivors(&bytes, at));
        let [damage] = &opened.damage[..] else { panic!("{:?}", opened.damage) };
        assert!((damage.offset..damage.offset + damage.bytes).contains(&(at as u64)));
        let last = at + 1 == bytes.len();
        assert_eq!(damage.kind == DamageKind::TornTail, last);
        opened.journal.append("after").unwrap();
        drop(opened);
        assert_eq!(read(directory.path()), [&survivors(&bytes, at)[..], &["after"]].concat());
        if !last {
            assert!(fs::read(present(directory.path())).unwrap().starts_with(&changed));
        }
    }
}

#[test]
fn a_hole_in_the_middle_costs_no_whole_record_behind_it() {
    let bytes = bytes_of(&RECORDS);
    let ends = ends(&bytes);
    let directory = tempfile::tempdir().unwrap();
    // as loss of power leaves it when a later block came to the disk before an earlier one
    let mut changed = bytes.clone();
    changed[5..ends[2] + 3].fill(0);
    fs::write(present(directory.path()), &changed).unwrap();
    let opened = open(directory.path());
    assert_eq!(opened.records, &RECORDS[4..]);
    let damage = Damage {
        file: present(directory.path()),
        offset: 0,
        bytes: ends[3] as u64,
        kind: DamageKind::Corrupt,
    };
    assert_eq!(opened.damage, [damage]);
    assert_eq!(journal::read(directory.path()).unwrap().count(), 1);
}
