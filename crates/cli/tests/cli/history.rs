//! `trusswatch history` against a stand-in for the diagnosers.

use serde_json::Value;
use vocabulary::{FaultState, ModulePhase, Topic};

use crate::binary::run;
use crate::stand_in::{StandIn, bias, identification, nowhere};

/// A journal of three pages with a gap, a whole one, and a module without any.
async fn tower() -> StandIn {
    let mut tower = StandIn::open("tower").await;
    let transition = |component: &str, sequence| {
        let state = if sequence % 2 == 1 { FaultState::Latched } else { FaultState::Normal };
        tower.transition(component, state, sequence)
    };
    let first = [3, 4, 5, 8, 9].map(|sequence| transition("module1/sensor/g2", sequence));
    let second = vec![transition("module2/actuator/a1", 1), transition("module2/sensor/g6", 2)];
    tower.journal("module1", first.to_vec(), 10).await;
    tower.journal("module2", second, 3).await;
    tower.silence("module3", Topic::History).await;
    for (module, peers) in [("module1", &["module4"][..]), ("module2", &[]), ("module3", &[])] {
        tower.statuses(module, ModulePhase::InService, peers).await;
        tower.token(module).await;
    }
    tower
}

#[tokio::test(flavor = "multi_thread")]
async fn three_pages_become_one_table_and_what_is_missing_is_noted() {
    let outcome = tower().await.run(&["history", "--timeout", "10"]);
    outcome.succeeds();
    let read: Vec<String> = outcome
        .stdout
        .lines()
        .filter(|line| line.trim_start().starts_with("2026-"))
        .map(|line| line.split_whitespace().skip(1).take(2).collect::<Vec<_>>().join("."))
        .collect();
    let expected =
        ["module2.1", "module2.2", "module1.3", "module1.4", "module1.5", "module1.8", "module1.9"];
    assert_eq!(read, expected);
    for note in [
        "note: module1: the journal reaches back to transition 3 only",
        "note: module1: transitions 6 to 7 are missing from the journal",
        "note: module3: no answer within 10s; its history is unavailable",
        "note: module4: no answer within 10s; its history is unavailable",
    ] {
        assert!(outcome.stdout.contains(note), "`{note}` is not in:\n{}", outcome.stdout);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn json_contains_the_same() {
    let outcome = tower().await.run(&["history", "--json", "--timeout", "10", "--limit", "3"]);
    outcome.succeeds();
    let document: Value = serde_json::from_str(&outcome.stdout).unwrap();
    let sequences = |list: &str, field: &str| -> Vec<u64> {
        let list = document[list].as_array().unwrap().iter();
        list.map(|entry| entry[field].as_u64().unwrap()).collect()
    };
    assert_eq!(document["v"], 1);
    assert_eq!(sequences("transitions", "sequence"), [5, 8, 9]);
    assert_eq!(sequences("modules", "first_sequence"), [3, 1]);
    assert_eq!(sequences("modules", "next_sequence"), [10, 3]);
    assert_eq!(sequences("gaps", "from_sequence"), [6]);
    assert_eq!(sequences("gaps", "to_sequence"), [7]);
    let silent = document["silent"].as_array().unwrap();
    assert_eq!(silent[0]["module"], "module3");
    assert_eq!(document["transitions"][0]["component"], "module1/sensor/g2");
}

#[tokio::test(flavor = "multi_thread")]
async fn modules_components_and_a_beginning_can_be_chosen() {
    let tower = tower().await;
    let components = |arguments: &[&str]| -> Vec<String> {
        let outcome = tower.run(&[&["history", "--json"], arguments].concat());
        outcome.succeeds();
        let document: Value = serde_json::from_str(&outcome.stdout).unwrap();
        let transitions = document["transitions"].as_array().unwrap().iter();
        transitions.map(|t| format!("{} {}", t["sequence"], t["component"])).collect()
    };
    let chosen = components(&["--module", "module2"]);
    assert_eq!(chosen, ["1 \"module2/actuator/a1\"", "2 \"module2/sensor/g6\""]);
    let chosen = components(&["--component", "module2/sensor/g6"]);
    assert_eq!(chosen, ["2 \"module2/sensor/g6\""]);
    let chosen = components(&["--module", "module1", "--from", "8"]);
    assert_eq!(chosen, ["8 \"module1/sensor/g2\"", "9 \"module1/sensor/g2\""]);
    let only_8_and_9 =
        ["--module", "module1", "--since", "2026-11-18T11:06:42Z", "--until", "2030-01-01"];
    assert_eq!(components(&only_8_and_9).len(), 2);
    assert_eq!(components(&["--until", "2026-01-01 00:00"]), [""; 0]);
    let yesterday = tower.run(&["history", "--since", "yesterday"]);
    yesterday.fails(2, &["invalid time `yesterday`: expected UTC, e.g. `2026", "or a time ago"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_a_fault_is_stands_after_it() {
    let mut tower = StandIn::open("tower").await;
    let transitions = [1, 2, 3]
        .map(|sequence| tower.transition("module1/sensor/g2", FaultState::Latched, sequence * 10));
    let first = identification(&transitions[0], false, vec![bias(0.6)]);
    let last = identification(&transitions[2], true, vec![bias(0.99)]);
    tower.journal_with("module1", transitions.to_vec(), vec![first, last], 31).await;
    tower.statuses("module1", ModulePhase::InService, &[]).await;
    tower.token("module1").await;
    let outcome = tower.run(&["history"]);
    outcome.succeeds();
    let lines: Vec<String> = outcome
        .stdout
        .lines()
        .filter(|line| line.trim_start().starts_with("2026-"))
        .map(|line| line.split_whitespace().skip(2).collect::<Vec<_>>().join(" "))
        .collect();
    let expected = [
        "10 sensor/g2 latched 3118 changed at step 3112",
        "10 sensor/g2 not identified 4108 bias: not yet decided",
        "20 sensor/g2 latched 3118 changed at step 3112",
        "30 sensor/g2 latched 3118 changed at step 3112",
        "30 sensor/g2 identified 4108 bias of +45.1 µm (44.8 to 45.4)",
    ];
    assert_eq!(lines, expected);
    let document: Value = serde_json::from_str(&tower.run(&["history", "--json"]).stdout).unwrap();
    let found = document["identifications"].as_array().unwrap();
    assert_eq!((found.len(), &found[1]["decided"]), (2, &Value::from(true)));
}

#[tokio::test(flavor = "multi_thread")]
async fn without_any_journal_it_fails() {
    let tower = tower().await;
    let named = tower.run(&["history", "--module", "module3", "module9", "--timeout", "10"]);
    named.fails(4, &["module3: no answer within 10s", "module9: not seen"]);
    let nowhere = nowhere();
    run(&["history", "--connect", &nowhere, "--timeout", "0.5"]).fails(4, &[&nowhere]);
}
