//! A journal that a later version wrote keeps what it says, and what is not understood of it is not taken for healthy.

use std::path::Path;

use daemon::diagnoser::StateDirectory;
use diagnosis::{Doubt, Memory, Verdict};
use journal::Journal;
use names::{RunId, Step};
use serde_json::json;
use wire::StateChange;

/// Spaces and the order of fields are the later version's own.
const LATER_RECORD: &str = r#"{ "weight_kg":1.50e3,"record":"weighing", "module":"module1" }"#;

fn transition(component: &str, sequence: u64, state: &str) -> String {
    let step = sequence * 100;
    let evidence = json!({
        "step": step, "residual": 1e-4, "level": 0.0, "divergence": 2.0, "threshold": 1.0, "ratio": 2.0,
    });
    let transition = json!({
        "record": "transition", "structure": "tower", "module": "module1",
        "component": format!("module1/{component}"), "kind": "sensor", "state": state,
        "sequence": sequence, "run": 7, "onset_step": step, "detection_step": step,
        "decided_step": step, "evidence": evidence, "time_unix_ns": sequence,
    });
    transition.to_string()
}

fn written(directory: &Path, records: &[String]) {
    Journal::open(directory).unwrap().journal.append_all(records).unwrap();
}

fn read(directory: &Path) -> Vec<String> {
    journal::read(directory).unwrap().map(Result::unwrap).collect()
}

/// What is remembered after the journal has been opened and two new files have been begun.
fn after_two_rotations(directory: &Path) -> Memory {
    let module = "module1".parse().unwrap();
    let mut state = StateDirectory::open(directory, 0, &module).unwrap();
    for step in [1, 2] {
        let change = StateChange::at("sensor/g1".parse().unwrap(), Step(step), 2.0);
        assert!(state.keep(RunId(7), change));
    }
    drop(state);
    StateDirectory::open(directory, 0, &module).unwrap().memory()
}

fn verdicts(memory: &Memory) -> Vec<(String, &Verdict)> {
    memory.latest.iter().map(|one| (one.component.to_string(), &one.verdict)).collect()
}

#[test]
fn a_later_state_counts_as_a_number_and_leaves_the_latest_verdict_that_is_understood() {
    let directory = tempfile::tempdir().unwrap();
    let later = transition("sensor/g1", 6, "quarantined");
    let records = [transition("sensor/g1", 5, "latched"), later.clone(), LATER_RECORD.to_owned()];
    written(directory.path(), &records);
    for _ in 0..2 {
        let memory = after_two_rotations(directory.path());
        assert_eq!(memory.sequence, 6);
        assert_eq!(verdicts(&memory), [("sensor/g1".to_owned(), &Verdict::Latched)]);
        let kept = read(directory.path());
        for text in [&later, LATER_RECORD] {
            assert!(kept.iter().any(|kept| kept == text), "{text} is not in {kept:#?}");
        }
    }
}

#[test]
fn what_follows_a_later_state_counts_again() {
    let directory = tempfile::tempdir().unwrap();
    let later = transition("sensor/g1", 6, "quarantined");
    let normal = transition("sensor/g1", 7, "normal");
    written(directory.path(), &[transition("sensor/g1", 5, "latched"), later.clone(), normal]);
    let memory = after_two_rotations(directory.path());
    assert_eq!(verdicts(&memory), [("sensor/g1".to_owned(), &Verdict::Normal)]);
    assert!(!read(directory.path()).contains(&later), "it is of the past");
}

#[test]
fn a_component_of_which_only_a_later_state_is_left_is_in_doubt() {
    let directory = tempfile::tempdir().unwrap();
    written(directory.path(), &[transition("sensor/g1", 6, "quarantined")]);
    let memory = after_two_rotations(directory.path());
    let doubt = Doubt::Unknowing(vec!["module1".parse().unwrap()]);
    assert_eq!(verdicts(&memory), [("sensor/g1".to_owned(), &Verdict::Unconfirmed { doubt })]);
}

#[test]
fn later_words_beside_the_state_leave_the_verdict() {
    let directory = tempfile::tempdir().unwrap();
    let with = |text: String, field: &str, value: serde_json::Value| {
        let mut transition: serde_json::Value = serde_json::from_str(&text).unwrap();
        transition[field] = value;
        transition.to_string()
    };
    let records = [
        with(transition("sensor/g1", 1, "latched"), "symptom", json!("resonance")),
        with(transition("sensor/g2", 2, "unconfirmed"), "doubt", json!("weather")),
        with(
            transition("sensor/g3", 3, "acknowledged"),
            "order",
            json!({"order": "delegate", "by": "ada", "note": null, "force": false}),
        ),
    ];
    written(directory.path(), &records);
    let memory = after_two_rotations(directory.path());
    let doubt = Doubt::Unknowing(vec!["module1".parse().unwrap()]);
    assert_eq!(
        verdicts(&memory),
        [
            ("sensor/g1".to_owned(), &Verdict::Latched),
            ("sensor/g2".to_owned(), &Verdict::Unconfirmed { doubt }),
            ("sensor/g3".to_owned(), &Verdict::Acknowledged),
        ]
    );
    let kept = read(directory.path());
    assert!(records.iter().all(|record| kept.contains(record)), "{kept:#?}");
}

#[test]
fn a_transition_that_cannot_be_read_is_kept_and_its_number_is_not_given_again() {
    let directory = tempfile::tempdir().unwrap();
    let later = transition("cable/c1", 9, "latched");
    let foreign = transition("cable/c1", 12, "latched").replace("module1", "module2");
    written(directory.path(), &[transition("sensor/g1", 5, "latched"), later.clone(), foreign]);
    let memory = after_two_rotations(directory.path());
    assert_eq!(memory.sequence, 9);
    assert!(read(directory.path()).contains(&later));
}

#[test]
fn records_of_later_versions_are_kept_once_and_not_without_bound() {
    let directory = tempfile::tempdir().unwrap();
    let record = |number: u64| format!(r#"{{"record":"weighing","number":{number}}}"#);
    written(directory.path(), &(0..600).map(record).collect::<Vec<_>>());
    for _ in 0..2 {
        after_two_rotations(directory.path());
        // Both files begin with them.
        let kept = read(directory.path());
        let weighings: Vec<&String> =
            kept.iter().filter(|text| text.contains("weighing")).collect();
        assert_eq!(weighings.len(), 2 * 512);
        assert_eq!(*weighings[0], record(600 - 512));
    }
}
