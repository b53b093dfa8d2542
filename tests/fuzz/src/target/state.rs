//! What a diagnoser left behind for the next one: records in its journal, and the watch file.
//!
//! The bytes are the records, one a line, then a [`WATCH_FILE`] and the two entries of the watch file, one
//! a line. Records and entries are given their checksums here, for no fuzzer finds those: what is tried is
//! what stands in them.

use std::fs;
use std::path::Path;

use daemon::diagnoser::StateDirectory;
use diagnosis::{Diagnoser, Memory};
use journal::Journal;
use vocabulary::{Change, ModuleName, RunId, Step};

use crate::workbench::with_directory;

use super::module::{lower, samples};

/// Before the watch file.
const WATCH_FILE: u8 = 0x1c;
/// How long an entry of the watch file is, its newline included.
const ENTRY_BYTES: usize = 256;
/// A run that nothing else is said of.
const OTHER_RUN: RunId = RunId(0xdead_beef);

/// What is remembered is consistent, a diagnoser continues from it, and the next restart remembers the same,
/// though by then a new journal was started.
pub(super) fn check(bytes: &[u8]) {
    let (records, watch) = match bytes.iter().position(|byte| *byte == WATCH_FILE) {
        Some(at) => (&bytes[..at], &bytes[at + 1..]),
        None => (bytes, &[][..]),
    };
    let module: ModuleName = "lower".parse().unwrap();
    with_directory(|directory| {
        write_journal(directory, records);
        write_watch_file(directory, watch);
        // A journal of another version is refused.
        let Ok(opened) = StateDirectory::open(directory, 0, &module) else { return };
        let memory = opened.memory();
        drop(opened);
        makes_sense(&memory);
        diagnosis_goes_on(&memory);
        is_remembered_again(directory, &module, &memory);
    });
}

fn open(directory: &Path, module: &ModuleName) -> StateDirectory {
    // A new file is begun with every record.
    StateDirectory::open(directory, 0, module).unwrap()
}

fn write_journal(directory: &Path, records: &[u8]) {
    let lines = records.split(|byte| *byte == b'\n').filter(|line| !line.is_empty());
    let texts = lines.filter_map(|line| std::str::from_utf8(line).ok());
    Journal::open(directory).unwrap().journal.append_all(texts).unwrap();
}

fn write_watch_file(directory: &Path, entries: &[u8]) {
    let mut content = Vec::new();
    for text in entries.split(|byte| *byte == b'\n').take(2) {
        let start = content.len();
        content.extend(format!("{:08x} ", crc32fast::hash(text)).bytes());
        content.extend(text);
        content.resize(start + ENTRY_BYTES - 1, b' ');
        content.push(b'\n');
    }
    fs::write(directory.join("watch"), content).unwrap();
}

fn makes_sense(memory: &Memory) {
    for (index, transition) in memory.latest.iter().enumerate() {
        assert!(transition.sequence <= memory.sequence, "{transition:?} of {}", memory.sequence);
        let same = |other: &&diagnosis::Transition| other.component == transition.component;
        assert!(!memory.latest[..index].iter().any(|other| same(&other)), "{transition:?} twice");
    }
    let changes = memory.watch.iter().flat_map(|watch| &watch.changes);
    assert!(changes.is_sorted_by_key(|change| change.step), "{:?}", memory.watch);
}

/// A diagnoser takes up the memory, and numbers what it finds from there on without a gap.
fn diagnosis_goes_on(memory: &Memory) {
    let mut diagnoser = Diagnoser::new(lower()).unwrap();
    diagnoser.recall(memory.clone());
    assert_eq!(diagnoser.next_sequence(), memory.sequence + 1);
    for known in &memory.latest {
        let verdict = diagnoser.verdicts().find(|(component, _)| **component == known.component);
        assert!(
            verdict.is_none_or(|(_, verdict)| *verdict == known.verdict),
            "{known:?} forgotten"
        );
    }
    let run = memory.watch.as_ref().map_or(RunId(1), |watch| watch.run);
    let mut next = memory.sequence + 1;
    let mut actions = Vec::new();
    for sample in samples(run, Step(0), 30).chain(samples(OTHER_RUN, Step(5), 30)) {
        diagnoser.take_sample(&sample, &mut actions);
    }
    for action in actions {
        if let diagnosis::Action::Publish(transition) = action {
            assert_eq!(transition.sequence, next);
            next += 1;
        }
    }
}

fn is_remembered_again(directory: &Path, module: &ModuleName, memory: &Memory) {
    let mut state = open(directory, module);
    // The first record makes what was there the older file, the second one drops it.
    for step in [1, 2] {
        let component = "sensor/g1".parse().unwrap();
        let change = Change::at(component, Step(step), 2.0);
        assert!(state.keep(OTHER_RUN, change));
    }
    drop(state);
    let mut state = open(directory, module);
    if memory.watch.as_ref().is_none_or(|watch| watch.run != OTHER_RUN) {
        assert_eq!(text(&state.memory()), text(memory));
    }
    state.note_watch(OTHER_RUN, Some((Step(3), Step(4)))).unwrap();
    drop(state);
    let noted = open(directory, module).memory().watch.unwrap();
    assert_eq!((noted.run, noted.watched), (OTHER_RUN, Some((Step(3), Step(4)))));
    let steps: Vec<u64> = noted.changes.iter().map(|change| change.step.0).collect();
    assert!([1, 2].iter().all(|step| steps.contains(step)), "{steps:?}");
}

/// A number that is not one equals nothing, hence the text; the order of components means nothing.
fn text(memory: &Memory) -> String {
    let mut memory = memory.clone();
    memory.latest.sort_by(|a, b| a.component.cmp(&b.component));
    format!("{memory:?}")
}
