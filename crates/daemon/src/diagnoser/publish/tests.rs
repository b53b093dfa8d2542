use std::path::Path;
use std::time::Duration;

use shell::shutdown;
use shell::supervision::Supervisor;
use vocabulary::{
    FaultTransition, Input, InputQuestion, ModulePhase, PhaseChange, RunId, Step, Taken,
};

use super::events::publish;
use super::testing::{outbox, speaker};
use super::*;
use crate::diagnoser::store::JournalWriter;

const PATIENCE: Duration = Duration::from_secs(20);

fn latched(sequence: u64) -> OutgoingEvent {
    let untouched = speaker().untouched(&"sensor/g1".parse().unwrap(), 0);
    let verdict = vocabulary::Verdict::Latched;
    OutgoingEvent::Fault(Box::new(FaultTransition { sequence, verdict, ..untouched }))
}

fn identification() -> OutgoingEvent {
    let found = diagnosis::identification::IdentificationResult {
        run: RunId(1),
        sequence: 1,
        component: "sensor/g1".parse().unwrap(),
        as_of: Step(5),
        candidates: Vec::new(),
        signature: Vec::new(),
    };
    OutgoingEvent::Identification(Box::new(speaker().identification(found, 0)))
}

fn input(number: u64) -> OutgoingEvent {
    OutgoingEvent::Input(Box::new(Input {
        structure: "tower".parse().unwrap(),
        module: "module1".parse().unwrap(),
        process: 1,
        number,
        samples: 0,
        run: None,
        step: None,
        time_unix_ns: 0,
        taken: Taken::Gap { from: Step(1), missing: 1 },
    }))
}

fn phase() -> OutgoingEvent {
    OutgoingEvent::Phase(Box::new(PhaseChange {
        structure: "tower".parse().unwrap(),
        module: "module1".parse().unwrap(),
        phase: ModulePhase::InService,
        number: 1,
        not_monitored: std::collections::BTreeMap::new(),
        before: None,
        run: None,
        step: None,
        reason: String::new(),
        time_unix_ns: 0,
    }))
}

/// The thread that writes has started.
fn journal(directory: &Path) -> (ModuleStore, std::thread::JoinHandle<()>) {
    let module = "module1".parse().unwrap();
    let (writer, store, _) = JournalWriter::open(Some(directory), 100_000, &module).unwrap();
    let components = ["sensor/g1".parse().unwrap()];
    store.lock().components.configure(&module, &components, String::new(), 0);
    let writes = store.clone();
    (store, std::thread::spawn(move || writer.run(&writes)))
}

fn stored(directory: &Path) -> String {
    let records = journal::read(directory).into_iter().flatten();
    records.filter_map(Result::ok).collect::<Vec<_>>().join("\n")
}

#[test]
fn a_network_that_takes_nothing_holds_up_no_journal_and_no_order_is_changed() {
    let directory = tempfile::tempdir().unwrap();
    let (store, written) = journal(directory.path());
    let (outbox, events) = outbox(store.clone(), 16);
    let (trigger, shutdown) = shutdown::pair();
    let crew = Crew::new(shutdown, Supervisor::from_environment().pulse());
    let (putting, put) = std::sync::mpsc::channel();
    let (open, gate) = std::sync::mpsc::channel::<()>();
    let ended = crew.thread("events", move |lane| {
        publish(&events, &store, lane, |event| {
            let OutgoingEvent::Fault(transition) = event else { return };
            putting.send((transition.sequence, transition.durable)).unwrap();
            gate.recv().unwrap();
        });
    });
    outbox.event(latched(1));
    assert_eq!(put.recv_timeout(PATIENCE).unwrap(), (1, true));
    // From here on the network blocks.
    outbox.event(latched(2));
    outbox.event(latched(3));
    let begun = Instant::now();
    while !stored(directory.path()).contains(r#""sequence":3"#) {
        assert!(begun.elapsed() < PATIENCE, "not stored: {}", stored(directory.path()));
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(put.try_recv().is_err(), "the network is still blocked");
    (0..3).for_each(|_| open.send(()).unwrap());
    let others = [put.recv_timeout(PATIENCE).unwrap(), put.recv_timeout(PATIENCE).unwrap()];
    assert_eq!(others, [(2, true), (3, true)]);
    trigger.pull();
    drop(outbox);
    written.join().unwrap();
    ended.unwrap().blocking_recv().unwrap();
}

#[test]
fn without_a_disk_faults_are_published_and_say_so() {
    let directory = tempfile::tempdir().unwrap();
    let state = directory.path().join("state");
    std::fs::write(&state, "in the way").unwrap();
    let (store, written) = journal(&state);
    let (outbox, events) = outbox(store.clone(), 16);
    outbox.event(latched(1));
    let WaitingEvent { ticket, .. } = events.recv_timeout(PATIENCE).unwrap();
    assert!(!store.wait_for(ticket));
    drop(outbox);
    written.join().unwrap();
}

#[test]
fn every_event_without_room_is_counted_and_what_it_says_is_stored() {
    let directory = tempfile::tempdir().unwrap();
    let (store, written) = journal(directory.path());
    let (outbox, _events) = outbox(store.clone(), 1);
    outbox.event(phase());
    for event in [latched(1), identification(), input(1), phase()] {
        outbox.event(event);
    }
    let PublisherCounters { events, events_lost, .. } = outbox.counters();
    assert_eq!((events, events_lost), (5, 4));
    let latest = store.lock().components.states(&speaker(), |_| true, None, 0).remove(0);
    assert_eq!(latest.state.sequence, 1);
    drop(outbox);
    written.join().unwrap();
    assert!(store.lock().writes.has(latest.ticket));
    let stored = stored(directory.path());
    for record in ["transition", "identification"] {
        assert!(stored.contains(&format!(r#""record":"{record}""#)), "{stored}");
    }
}

/// The numbers of the inputs that a process gives which starts on this state directory.
fn given_after_restart(directory: &Path, question: InputQuestion) -> Vec<u64> {
    let (store, written) = journal(directory);
    let cache = {
        let state = store.lock();
        InputCache::new(9, state.components.inputs(&"module1".parse().unwrap()))
    };
    store.close();
    written.join().unwrap();
    let given = cache.asked(question).into_iter();
    let read = given.map(|bytes| vocabulary::decode::<Input>(&bytes.to_bytes()).unwrap());
    read.map(|input| input.number).collect()
}

#[test]
fn what_led_to_a_transition_of_a_killed_process_is_given_by_the_next_one() {
    let directory = tempfile::tempdir().unwrap();
    let (store, written) = journal(directory.path());
    // Nothing is published.
    let (outbox, _events) = outbox(store, 16);
    for event in [input(1), latched(1), input(2), input(3), latched(2), input(4)] {
        outbox.event(event);
    }
    drop(outbox);
    written.join().unwrap();
    let all = InputQuestion::default();
    assert_eq!(given_after_restart(directory.path(), all), [1, 2, 3]);
    let some = InputQuestion { process: Some(1), from: Some(2), to: None };
    assert_eq!(given_after_restart(directory.path(), some), [2, 3]);
    let other = InputQuestion { process: Some(2), ..all };
    assert_eq!(given_after_restart(directory.path(), other), [0; 0]);
}
