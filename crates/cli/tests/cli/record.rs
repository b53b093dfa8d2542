//! `trusswatch record` through the real binary: what it does without a network.

use serde_json::Value;
use tempfile::TempDir;

use crate::binary::run;
use crate::replay::{published, write};

#[test]
fn a_torn_recording_is_finished_and_verifies_as_far_as_it_goes() {
    let directory = TempDir::new().unwrap();
    let path = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    let (whole, torn, mended) = (path("whole.mcap"), path("torn.mcap"), path("mended.mcap"));
    write(whole.as_ref(), &published());
    let bytes = std::fs::read(&whole).unwrap();
    std::fs::write(&torn, &bytes[..bytes.len() * 2 / 3]).unwrap();
    let as_it_is = run(&["replay", &torn, "--verify"]);
    assert_eq!(as_it_is.code, Some(0), "{}", as_it_is.stderr);
    assert!(as_it_is.stderr.contains("torn.mcap: ends within"), "{}", as_it_is.stderr);
    let outcome = run(&["record", "--recover", &torn, "--to", &mended, "--json"]);
    outcome.succeeds();
    let document: Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert!(document["messages"].as_u64().unwrap() > 5000, "{document}");
    assert!(document["ending"].as_str().unwrap().contains("chunk"), "{document}");
    let verified = run(&["replay", &mended, "--verify"]);
    verified.succeeds();
    assert!(verified.stdout.contains("of 2 modules: the same"), "{}", verified.stdout);
}

#[test]
fn what_cannot_be_recorded_or_recovered_is_named() {
    run(&["record"]).fails(2, &["no endpoint given", "--connect"]);
    run(&["record", "--to", "x.mcap"]).fails(2, &["--recover"]);
    run(&["record", "--recover", "/nonexistent.mcap"]).fails(3, &["/nonexistent.mcap"]);
    let directory = TempDir::new().unwrap();
    let file = directory.path().join("no.mcap");
    std::fs::write(&file, "this is no recording").unwrap();
    run(&["record", "--recover", file.to_str().unwrap()]).fails(3, &["no.mcap"]);
}

#[test]
fn a_recording_of_which_nothing_can_be_recovered_is_no_success() {
    let directory = TempDir::new().unwrap();
    let path = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    let (whole, torn, mended) = (path("whole.mcap"), path("torn.mcap"), path("mended.mcap"));
    write(whole.as_ref(), &published());
    // Neither the first chunk nor the summary.
    std::fs::write(&torn, &std::fs::read(&whole).unwrap()[..1000]).unwrap();
    let outcome = run(&["record", "--recover", &torn, "--to", &mended]);
    outcome.fails(3, &["torn.mcap: no message could be recovered"]);
    assert!(outcome.stdout.contains(": 0 messages"), "{}", outcome.stdout);
}
