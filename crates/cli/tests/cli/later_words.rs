//! Words of later versions are shown as such and never pass for healthy.

use serde_json::{Value, json};
use wire::{FaultState, FaultTransition, HistoryPage, ModulePhase, Topic};

use crate::stand_in::StandIn;

const LATER: &str = "a_word_of_a_later_version";
const GAGE: &str = "module1/sensor/g1";

/// A module in service whose only component answers with one word replaced.
async fn with_word(state: FaultState, place: &str) -> StandIn {
    let mut tower = StandIn::open("tower").await;
    let mut text = message(&tower.transition(GAGE, state, 6));
    let agrees = json!({"agreement": "agrees", "as_of_step": 4711, "reason": null});
    text["condition"] = agrees;
    if place != "none" {
        *text.pointer_mut(place).unwrap() = LATER.into();
    }
    tower.text("module1", Topic::Fault("sensor/g1".parse().unwrap()), text.to_string()).await;
    tower.statuses("module1", ModulePhase::InService, &[]).await;
    tower.token("module1").await;
    tower
}

fn message(transition: &FaultTransition) -> Value {
    serde_json::from_slice(&wire::encode(transition).unwrap()).unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_later_state_is_unknown_and_not_well() {
    let tower = with_word(FaultState::Latched, "/state").await;
    let checked = tower.run(&["faults", "--exit-code"]);
    assert_eq!(checked.code, Some(1), "{}", checked.stdout);
    let why = "its state, perhaps a fault, is one that only a later version knows";
    assert!(checked.stdout.contains("0 of 1 components are normal, 1 unknown"));
    assert!(checked.stdout.contains(GAGE) && checked.stdout.contains(why), "{}", checked.stdout);
    assert!(!checked.stdout.contains("not understood"), "{}", checked.stdout);
    let shown = tower.run(&["fault", "show", GAGE]).stdout;
    assert_eq!(shown.trim_end(), format!("{GAGE} of tower: unknown; {why}"));
    let document: Value = serde_json::from_str(&tower.run(&["faults", "--json"]).stdout).unwrap();
    let found = (&document["all_is_well"], &document["modules"][0]["normal"]);
    assert_eq!(found, (&Value::from(false), &Value::from(0)));
    assert_eq!(document["components"][0]["state"], "unknown");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_stands_to_its_reference_in_a_later_way_is_not_normal() {
    let tower = with_word(FaultState::Normal, "none").await;
    assert_eq!(tower.run(&["faults", "--exit-code"]).code, Some(0));
    let tower = with_word(FaultState::Normal, "/condition/agreement").await;
    let checked = tower.run(&["faults", "--exit-code"]);
    assert_eq!(checked.code, Some(1), "{}", checked.stdout);
    let why = "how it stands to its reference, only a later version can tell";
    assert!(checked.stdout.contains(why), "{}", checked.stdout);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_later_phase_is_not_in_service() {
    let mut tower = StandIn::open("tower").await;
    let states = vec![tower.transition(GAGE, FaultState::Normal, 0)];
    tower.module("module1", ModulePhase::Other, &[], states).await;
    let checked = tower.run(&["faults", "--exit-code"]);
    assert_eq!(checked.code, Some(1), "{}", checked.stdout);
    assert!(checked.stdout.contains("unknown phase"), "{}", checked.stdout);
    assert!(checked.stdout.contains("0 of 1 components are normal, 1 unknown"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_history_with_later_words_is_shown_whole() {
    let mut tower = StandIn::open("tower").await;
    let transition = tower.transition(GAGE, FaultState::Latched, 1);
    let page = HistoryPage {
        structure: transition.structure.clone(),
        module: transition.module.clone(),
        transitions: vec![transition.clone(), FaultTransition { sequence: 2, ..transition }],
        identifications: Vec::new(),
        first_sequence: Some(1),
        next_sequence: 3,
        more: false,
    };
    let mut text: Value = serde_json::from_slice(&wire::encode(&page).unwrap()).unwrap();
    text["transitions"][0]["symptom"] = LATER.into();
    text["transitions"][1]["state"] = LATER.into();
    tower.text("module1", Topic::History, text.to_string()).await;
    tower.token("module1").await;
    let outcome = tower.run(&["history"]);
    outcome.succeeds();
    for part in
        ["it shows by something that only a later version knows", "unknown", "perhaps a fault"]
    {
        assert!(outcome.stdout.contains(part), "`{part}` is not in\n{}", outcome.stdout);
    }
}
