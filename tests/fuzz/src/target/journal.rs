//! The files of a journal.
//!
//! The bytes are one to three files with a [`NEXT_FILE`] between them: the present one, the older one and
//! the next one, as a crash may leave them. A file that is just `-` is not there. A line that begins with
//! `=` is given the checksum that makes it a record: no fuzzer finds those.

use std::fs;
use std::path::Path;

use journal::{Journal, Opened};

use crate::workbench::with_directory;

/// Between two files.
const NEXT_FILE: u8 = 0x1c;

/// Exactly the lines that fit their checksums are records, with the lock and without; everything else is
/// reported as damage; any journal can be appended to and rotated.
pub(super) fn check(bytes: &[u8]) {
    let files = Files::of(bytes);
    let expected = files.records();
    with_directory(|directory| {
        files.write(directory);
        assert_eq!(read(directory), expected, "read without the lock");
        let Opened { mut journal, records, damage } = Journal::open(directory).unwrap();
        assert_eq!(records, expected);
        let damaged: u64 = damage.iter().map(|damage| damage.bytes).sum();
        assert_eq!(damaged, files.bytes() - bytes_of(&expected));

        journal.append("appended").unwrap();
        drop(journal);
        let mut longer = expected;
        longer.push("appended".to_owned());
        let Opened { mut journal, records, .. } = Journal::open(directory).unwrap();
        assert_eq!(records, longer);

        journal.rotate(["rotated"]).unwrap();
        drop(journal);
        let kept = records_of(files.present_at_last()).len() + 1;
        longer.drain(..longer.len() - kept);
        longer.push("rotated".to_owned());
        assert_eq!(Journal::open(directory).unwrap().records, longer);
        assert_eq!(read(directory), longer, "read without the lock");
    });
}

/// What a directory holds.
struct Files {
    present: Option<Vec<u8>>,
    older: Option<Vec<u8>>,
    next: Option<Vec<u8>>,
}

impl Files {
    fn of(bytes: &[u8]) -> Self {
        let mut files = bytes.splitn(3, |byte| *byte == NEXT_FILE).map(framed);
        let mut file = || files.next().flatten();
        Self { present: file(), older: file(), next: file() }
    }

    fn write(&self, directory: &Path) {
        for (name, content) in
            [("journal", &self.present), ("journal.old", &self.older), ("journal.new", &self.next)]
        {
            if let Some(content) = content {
                fs::write(directory.join(name), content).unwrap();
            }
        }
    }

    /// The present file once a rotation that was cut short is settled: the next one takes an empty place.
    fn present_at_last(&self) -> &[u8] {
        self.present.as_ref().or(self.next.as_ref()).map_or(&[], Vec::as_slice)
    }

    fn records(&self) -> Vec<String> {
        let mut records = self.older.as_deref().map(records_of).unwrap_or_default();
        records.extend(records_of(self.present_at_last()));
        records
    }

    fn bytes(&self) -> u64 {
        (self.older.as_ref().map_or(0, Vec::len) + self.present_at_last().len()) as u64
    }
}

/// The content of a file, or none if it is not to be there.
fn framed(written: &[u8]) -> Option<Vec<u8>> {
    let line = |line: &[u8]| match line {
        [b'=', text @ ..] => {
            let record = text.strip_suffix(b"\n").unwrap_or(text);
            [checksum(record).as_bytes(), b" ", text].concat()
        }
        _ => line.to_vec(),
    };
    let lines = written.split_inclusive(|byte| *byte == b'\n');
    (written != b"-").then(|| lines.flat_map(line).collect())
}

/// The records by the format's definition, read without any of the journal's own code.
fn records_of(content: &[u8]) -> Vec<String> {
    let lines = content.split_inclusive(|byte| *byte == b'\n');
    let record = |line: &[u8]| {
        let line = std::str::from_utf8(line).ok()?.strip_suffix('\n')?;
        let (sum, text) = line.split_once(' ')?;
        (sum == checksum(text.as_bytes())).then(|| text.to_owned())
    };
    lines.filter_map(record).collect()
}

/// Checksum, space and newline besides the text.
fn bytes_of(records: &[String]) -> u64 {
    records.iter().map(|record| record.len() as u64 + 10).sum()
}

fn checksum(text: &[u8]) -> String {
    format!("{:08x}", crc32fast::hash(text))
}

fn read(directory: &Path) -> Vec<String> {
    journal::read(directory).unwrap().map(Result::unwrap).collect()
}
