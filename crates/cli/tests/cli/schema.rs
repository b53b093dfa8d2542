//! `trusswatch schema` through the real binary.

use serde_json::Value;

use crate::binary::{run, run_with};

#[test]
fn one_schema_and_all_of_them_say_the_same() {
    let one = run(&["schema", "sample"]);
    one.succeeds();
    let one: Value = serde_json::from_str(&one.stdout).unwrap();
    let all = run(&["schema"]);
    all.succeeds();
    let all: Value = serde_json::from_str(&all.stdout).unwrap();
    assert_eq!(all["sample"], one);
    assert_eq!(
        one["properties"]["demands_n"]["description"],
        "Demanded force of each actuator [N]."
    );
    assert_eq!(one["x-keys"][0]["key"], "trusswatch/{structure}/{module}/sample");
}

#[test]
fn the_list_names_every_message_with_its_keys() {
    let list = run(&["schema", "--list"]);
    list.succeeds();
    let all: Value = serde_json::from_str(&run(&["schema"]).stdout).unwrap();
    for name in all.as_object().unwrap().keys() {
        assert!(list.stdout.lines().any(|line| line.trim().starts_with(name.as_str())), "{name}");
    }
    for key in ["plant/command/inject", "plant/command/stroke"] {
        assert!(list.stdout.contains(key), "{key} is not in {}", list.stdout);
    }
}

#[test]
fn every_example_is_taken() {
    let all: Value = serde_json::from_str(&run(&["schema"]).stdout).unwrap();
    for name in all.as_object().unwrap().keys() {
        let example = run(&["schema", name, "--example"]);
        example.succeeds();
        let compact = serde_json::from_str::<Value>(&example.stdout).unwrap().to_string();
        let checked = run_with(&compact, &["schema", name, "--check", "-"]);
        checked.succeeds();
        assert_eq!(checked.stdout, format!("-: valid: 1 × {name}\n"));
    }
}

#[test]
fn messages_that_would_be_refused_are_named_by_their_lines() {
    let lines =
        "{\"v\":1,\"run\":1,\"step\":2}\n{\"v\":2,\"run\":1,\"step\":2}\n\n{\"v\":1,\"run\":1}\n";
    run_with(lines, &["schema", "progress", "--check", "-"]).fails(
        3,
        &[
            "error: -:2: unknown version 2",
            "error: -:3: malformed JSON",
            "error: -:4: invalid progress message: missing field `step`",
        ],
    );
}

#[test]
fn a_message_too_long_is_refused_and_the_next_one_is_read() {
    let long = format!("{{\"v\":1,\"x\":\"{}\"}}\n", "x".repeat(1 << 20));
    let lines = format!("{long}{{\"v\":1,\"run\":1,\"step\":2}}\n{{\"v\":3}}");
    let outcome = run_with(&lines, &["schema", "progress", "--check", "-"]);
    outcome.fails(3, &["error: -:1: 1048577 bytes are too many", "error: -:3: unknown version 3"]);
    assert_eq!(outcome.stderr.lines().count(), 2, "{}", outcome.stderr);
}

#[test]
fn an_unknown_message_is_answered_with_those_that_exist() {
    run(&["schema", "samples"]).fails(2, &["fault-transition", "module-status", "'sample'"]);
    run(&["schema", "sample", "--check", "/nowhere"]).fails(3, &["cannot read `/nowhere`"]);
    run(&["schema", "--example"]).fails(2, &["<MESSAGE>"]);
}
