//! A state directory that a former version wrote is read as that version meant it. Each folder beside

//! `data/state-0.1.0` is a module's own after a demo; a later version adds its own and keeps these.

use std::path::Path;

use daemon::diagnoser::StateDirectory;
use names::{RunId, Step};

const MIB: u64 = 1 << 20;

#[test]
fn a_state_directory_of_version_0_1_0_comes_back_whole() {
    let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/state-0.1.0");
    let directory = tempfile::tempdir().unwrap();
    for file in ["journal", "watch"] {
        std::fs::copy(kept.join(file), directory.path().join(file)).unwrap();
    }
    let state = StateDirectory::open(directory.path(), MIB, &"module1".parse().unwrap()).unwrap();
    let memory = state.memory();
    assert_eq!(memory.sequence, 44);
    let latest = memory.latest.iter().map(|transition| {
        let verdict = transition.verdict.as_str();
        format!("{} {verdict}, transition {}", transition.component, transition.sequence)
    });
    let latest: Vec<String> = latest.collect();
    assert_eq!(
        latest,
        [
            "sensor/g2 latched, transition 2",
            "sensor/g4 normal, transition 25",
            "sensor/g6 normal, transition 44",
            "sensor/g8 normal, transition 43",
            "sensor/g7 latched, transition 13",
            "actuator/a3 latched, transition 15",
            "actuator/a1 latched, transition 17",
            "sensor/g1 normal, transition 40",
            "sensor/g3 normal, transition 41",
            "sensor/g5 normal, transition 42",
        ]
    );
    let watch = memory.watch.unwrap();
    assert_eq!(watch.run, RunId(1_795_372_650_405_276));
    assert_eq!(watch.watched, Some((Step(2510), Step(42_013))));
    let changes = watch.changes.iter().map(|change| (change.component.to_string(), change.step.0));
    let changes: Vec<(String, u64)> = changes.collect();
    assert_eq!(changes.len(), 32);
    assert_eq!(changes.first(), Some(&("sensor/g2".to_owned(), 3112)));
    assert_eq!(changes.last(), Some(&("sensor/g3".to_owned(), 32_186)));
}
