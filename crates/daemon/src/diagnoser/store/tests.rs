use journal::Journal;
use vocabulary::{FaultTransition, Identification, RunId, Step, Verdict};

use super::watch_file::WatchFile;
use super::*;

fn module() -> ModuleName {
    "m1".parse().unwrap()
}

fn open_at(directory: &Path, rotate_bytes: u64) -> (JournalWriter, ModuleStore) {
    let (writer, store, _) = JournalWriter::open(Some(directory), rotate_bytes, &module()).unwrap();
    let components = ["sensor/g1".parse().unwrap(), "sensor/g2".parse().unwrap()];
    store.lock().components.configure(&module(), &components, String::new(), 0);
    (writer, store)
}

fn open(directory: &Path) -> (JournalWriter, ModuleStore) {
    open_at(directory, 1000)
}

fn change(step: u64) -> JournalRecord {
    let change = Change::at("sensor/g1".parse().unwrap(), Step(step), 2.0);
    JournalRecord::Change { run: RunId(1), change }
}

fn transition(component: &str, sequence: u64, verdict: Verdict) -> FaultTransition {
    let component = component.parse().unwrap();
    let untouched = FaultTransition::untouched("t".parse().unwrap(), component, 5);
    FaultTransition { sequence, verdict, ..untouched }
}

/// As the outbox does.
fn take(store: &ModuleStore, transition: FaultTransition) -> u64 {
    let mut state = store.lock();
    let ticket = state.writes.next_ticket();
    let transition = state.components.transition(transition, ticket);
    let record = JournalRecord::Transition(Box::new(transition));
    let ticket = state.writes.hand_in(Some(record), None, Instant::now());
    store.unlock(state);
    ticket
}

fn identify(store: &ModuleStore, sequence: u64) {
    let transition = transition("m1/sensor/g1", sequence, Verdict::Latched);
    let found = Identification {
        structure: transition.structure,
        module: transition.module,
        component: transition.component,
        run: RunId(1),
        sequence,
        as_of_step: Step(9),
        decided: false,
        candidates: Vec::new(),
        signature: None,
        since_unix_ns: None,
        time_unix_ns: 0,
    };
    let mut state = store.lock();
    let found = state.components.identification(found).unwrap();
    let record = JournalRecord::Identification(Box::new(found));
    state.writes.hand_in(Some(record), None, Instant::now());
    store.unlock(state);
}

fn save((writer, store): &mut (JournalWriter, ModuleStore), record: JournalRecord) -> bool {
    store.record(record);
    writer.write_waiting(store)
}

fn problem(store: &ModuleStore) -> Option<String> {
    store.lock().writes.status(Instant::now()).problem
}

fn recalled(store: &ModuleStore) -> Vec<u64> {
    let latest = store.lock().components.published().0;
    latest.iter().map(|latest| latest.sequence).collect()
}

fn stored(directory: &Path) -> Vec<String> {
    journal::read(directory).unwrap().map(Result::unwrap).collect()
}

#[test]
fn what_cannot_be_written_is_kept_and_written_later() {
    let directory = tempfile::tempdir().unwrap();
    let state = directory.path().join("state");
    std::fs::write(&state, "in the way").unwrap();
    let mut opened = open(&state);
    assert!(problem(&opened.1).is_some());
    assert!(!save(&mut opened, change(1)));
    assert_eq!(opened.1.lock().writes.status(Instant::now()).unsaved, 1);
    std::fs::remove_file(&state).unwrap();
    assert!(save(&mut opened, change(2)));
    assert_eq!(
        (problem(&opened.1), opened.1.lock().writes.status(Instant::now()).unsaved),
        (None, 0)
    );
    drop(opened);
    assert_eq!(stored(&state).len(), 2);
}

#[test]
fn whatever_the_order_of_its_records_a_rotated_journal_knows_the_same_latest_transition() {
    let directory = tempfile::tempdir().unwrap();
    let recorded = |component: &str, sequence| {
        let transition = transition(component, sequence, Verdict::Normal);
        JournalRecord::Transition(Box::new(transition)).to_text().unwrap()
    };
    let records = [
        recorded("m1/sensor/g1", 3),
        recorded("m1/sensor/g1", 5),
        recorded("m1/sensor/g1", 4),
        recorded("m2/sensor/g1", 6),
    ];
    Journal::open(directory.path()).unwrap().journal.append_all(records).unwrap();
    let mut opened = open_at(directory.path(), 0);
    assert_eq!(recalled(&opened.1), [5]);
    // The first file becomes the older one, and is gone.
    assert!(save(&mut opened, change(1)) && save(&mut opened, change(2)));
    drop(opened);
    assert_eq!(recalled(&open(directory.path()).1), [5]);
    let kept = stored(directory.path());
    assert!(kept.iter().any(|text| text.contains("m2/sensor/g1")), "{kept:?}");
}

#[test]
fn a_rotated_journal_knows_what_a_present_fault_is_and_forgets_that_of_a_reset_one() {
    let directory = tempfile::tempdir().unwrap();
    let published = |store: &ModuleStore| store.lock().components.published().1.len();
    let mut opened = open_at(directory.path(), 0);
    take(&opened.1, transition("m1/sensor/g1", 3, Verdict::Latched));
    identify(&opened.1, 3);
    for step in 1..4 {
        assert!(save(&mut opened, change(step)));
    }
    drop(opened);
    let (mut writer, store) = open_at(directory.path(), 0);
    assert_eq!(published(&store), 1);
    take(&store, transition("m1/sensor/g1", 4, Verdict::Normal));
    assert!(writer.write_waiting(&store));
    drop(writer);
    assert_eq!(published(&open(directory.path()).1), 0);
}

#[test]
fn the_latest_state_reaches_the_file_whatever_was_dropped_meanwhile() {
    let directory = tempfile::tempdir().unwrap();
    let state = directory.path().join("state");
    std::fs::write(&state, "in the way").unwrap();
    let mut opened = open(&state);
    take(&opened.1, transition("m1/sensor/g1", 3, Verdict::Latched));
    take(&opened.1, transition("m1/sensor/g2", 7, Verdict::Latched));
    // More than the queue holds, and more than wait for the disk.
    for round in 0..5 {
        for step in 0..4096 {
            opened.1.record(change(4096 * round + step));
        }
        assert!(!opened.0.write_waiting(&opened.1));
    }
    assert!(
        opened.1.lock().writes.status(Instant::now()).lost > 2,
        "{:?}",
        opened.1.lock().writes.status(Instant::now())
    );
    std::fs::remove_file(&state).unwrap();
    assert!(save(&mut opened, change(1)));
    drop(opened);
    assert_eq!(recalled(&open(&state).1), [3, 7]);
}

#[test]
fn a_count_has_one_incarnation_and_a_wiped_directory_begins_a_later_one() {
    let incarnation = |directory: &Path| {
        let (writer, store) = open(directory);
        let incarnation = store.lock().components.incarnation();
        (writer, store, incarnation)
    };
    let later = |than: u64| while shell::clock::unix_ns() / 1_000_000 <= than {};
    let directory = tempfile::tempdir().unwrap();
    let (_, _, first) = incarnation(directory.path());
    // A process that ended before it wrote anything has numbered nothing that was kept.
    later(first);
    let (writer, store, begun) = incarnation(directory.path());
    assert!(begun > first);
    writer.note_start(&store);
    let mut opened = (writer, store);
    for step in 0..100 {
        assert!(save(&mut opened, change(step)));
    }
    drop(opened);
    assert_eq!(incarnation(directory.path()).2, begun, "after new files too");
    later(begun);
    let wiped = tempfile::tempdir().unwrap();
    assert!(incarnation(wiped.path()).2 > begun);
}

#[test]
fn a_second_writer_of_the_same_directory_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let _first = open(directory.path());
    let second = JournalWriter::open(Some(directory.path()), 1000, &module());
    let error = second.err().unwrap().to_string();
    assert!(error.contains("in use by process"), "{error}");
}

#[test]
fn a_new_file_begins_with_the_present_state() {
    let directory = tempfile::tempdir().unwrap();
    let mut opened = open(directory.path());
    for step in 0..100 {
        assert!(save(&mut opened, change(step)));
    }
    assert!(opened.1.lock().writes.status(Instant::now()).bytes < 30_000);
    drop(opened);
    let watch = WatchedSteps { run: RunId(1), watched: None };
    let memory = open(directory.path()).1.lock().components.memory(&module(), Some(watch));
    assert_eq!(memory.watch.unwrap().changes.len(), 100);
}

#[test]
fn the_watch_says_nothing_that_the_journal_lacks() {
    let directory = tempfile::tempdir().unwrap();
    let state = directory.path().join("state");
    let watch = |until| WatchedSteps { run: RunId(1), watched: Some((Step(0), Step(until))) };
    let watched = || WatchFile::open(&state).unwrap().1;
    let mut opened = open(&state);
    let blocked = directory.path().join("blocked");
    std::fs::write(&blocked, "in the way").unwrap();
    (opened.0.files.directory, opened.0.files.journal) = (Some(blocked.clone()), None);
    opened.1.lock().watched(watch(5), Instant::now());
    assert!(!save(&mut opened, change(5)));
    assert_eq!(watched(), None);
    std::fs::remove_file(&blocked).unwrap();
    opened.1.lock().watched(watch(6), Instant::now());
    assert!(save(&mut opened, change(6)));
    assert_eq!(watched(), Some(watch(6)));
}

#[test]
fn the_writer_ends_when_the_store_is_closed_and_has_written_all() {
    let directory = tempfile::tempdir().unwrap();
    let (writer, store) = open(directory.path());
    writer.note_start(&store);
    store.close();
    writer.run(&store);
    let records = stored(directory.path());
    assert!(records.len() == 1 && records[0].contains(r#""record":"start""#), "{records:?}");
}

#[test]
fn the_answer_of_the_disk_is_waited_for() {
    let directory = tempfile::tempdir().unwrap();
    let (writer, store) = open_at(directory.path(), 100_000);
    let writes = store.clone();
    let writing = std::thread::spawn(move || writer.run(&writes));
    for sequence in 1..4 {
        let ticket = take(&store, transition("m1/sensor/g1", sequence, Verdict::Latched));
        assert!(store.wait_for(ticket));
        assert_eq!(stored(directory.path()).len() as u64, sequence);
    }
    store.close();
    writing.join().unwrap();
}
