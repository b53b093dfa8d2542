//! A journal of another version is refused, whatever else it holds.

use std::path::Path;

use daemon::diagnoser::StateDirectory;
use journal::Journal;
use vocabulary::{Change, RunId, Step};

const START: &str =
    r#"{"record":"start","v":1,"software":"0.2.0","time_unix_ns":5,"incarnation":5}"#;

fn opened(directory: &Path) -> Result<StateDirectory, String> {
    StateDirectory::open(directory, 1 << 20, &"module1".parse().unwrap())
}

#[test]
fn a_journal_of_another_version_is_refused_in_one_line_and_left_as_it_is() {
    let other = START.replace(r#""v":1"#, r#""v":2"#);
    let without = START.replace(r#""v":1,"#, "");
    let unknown = r#"{"record":"weighing"}"#.to_owned();
    for (record, said) in [
        (other, "its version is 2, this program reads 1"),
        (without, "it has no version, this program reads 1"),
        (unknown, "unknown variant `weighing`"),
    ] {
        let directory = tempfile::tempdir().unwrap();
        let records = [START.to_owned(), record];
        Journal::open(directory.path()).unwrap().journal.append_all(&records).unwrap();
        let error = opened(directory.path()).unwrap_err();
        assert!(error.contains(said) && error.lines().count() == 1, "{error}");
        let kept: Vec<String> =
            journal::read(directory.path()).unwrap().map(Result::unwrap).collect();
        assert_eq!(kept, records);
    }
}

#[test]
fn a_journal_of_this_version_is_opened() {
    let directory = tempfile::tempdir().unwrap();
    Journal::open(directory.path()).unwrap().journal.append_all([START]).unwrap();
    let mut state = opened(directory.path()).unwrap();
    assert!(state.keep(RunId(7), Change::at("sensor/g1".parse().unwrap(), Step(1), 2.0)));
    drop(state);
    assert!(opened(directory.path()).is_ok());
}
