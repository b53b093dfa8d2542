//! A word that a later version adds to an enumeration makes no reader refuse the message, and never passes for healthy.
#![expect(clippy::unwrap_used, clippy::panic, reason = "helpers of tests fail loudly")]

use std::collections::BTreeSet;

use serde_json::{Value, json};
use wire::catalogue::{Entry, Travels, catalogue};
use wire::{
    FaultState, FaultTransition, Injection, Input, Key, ModulePhase, PhaseChange, Taken, decode,
};

const LATER: &str = "a_word_of_a_later_version";

/// The messages for readers, whatever was ordered or asked before.
fn for_readers() -> impl Iterator<Item = Entry> {
    let commands = |entry: &Entry| entry.travels.iter().any(|(_, how)| *how == Travels::Querying);
    catalogue().into_iter().filter(move |entry| !commands(entry))
}

/// The example of a message, with a word in every place for one.
fn example(entry: &Entry) -> Value {
    let mut message: Value = serde_json::from_str(entry.example()).unwrap();
    if entry.name == "fault-transition" {
        message["doubt"] = json!("silent");
        message["order"] = json!({"order": "reset", "by": "ada", "note": null, "force": false});
        message["state_order"] = message["order"].clone();
    }
    message
}

/// The words of all enumerations in a schema.
fn words(schema: &Value, found: &mut BTreeSet<String>) {
    match schema {
        Value::Object(fields) => {
            found.extend(fields.get("const").and_then(Value::as_str).map(str::to_owned));
            let listed = fields.get("enum").and_then(Value::as_array).into_iter().flatten();
            found.extend(listed.filter_map(Value::as_str).map(str::to_owned));
            fields.values().for_each(|inner| words(inner, found));
        }
        Value::Array(items) => items.iter().for_each(|inner| words(inner, found)),
        _ => {}
    }
}

/// Where a message has one of these words, as JSON pointers.
fn places(value: &Value, words: &BTreeSet<String>, at: &str, found: &mut Vec<String>) {
    match value {
        Value::String(text) if words.contains(text) => found.push(at.to_owned()),
        Value::Object(fields) => {
            fields.iter().for_each(|(name, inner)| {
                places(inner, words, &format!("{at}/{name}"), found);
            });
        }
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(place, inner)| {
                places(inner, words, &format!("{at}/{place}"), found);
            });
        }
        _ => {}
    }
}

/// Every message for readers with one of its words replaced, and which.
fn with_later_words() -> Vec<(Entry, String, Value)> {
    let mut all = Vec::new();
    for entry in for_readers() {
        let (mut known, mut found) = (BTreeSet::new(), Vec::new());
        words(&entry.schema(), &mut known);
        let message = example(&entry);
        places(&message, &known, "", &mut found);
        for place in found {
            let mut later = message.clone();
            *later.pointer_mut(&place).unwrap() = json!(LATER);
            all.push((entry.clone(), place, later));
        }
    }
    all
}

fn transition(message: &Value) -> FaultTransition {
    decode(message.to_string().as_bytes()).unwrap_or_else(|error| panic!("{error}: {message}"))
}

#[test]
fn a_message_with_a_later_word_is_taken() {
    let mut places = BTreeSet::new();
    for (entry, place, message) in with_later_words() {
        let taken = entry.check(message.to_string().as_bytes());
        taken.unwrap_or_else(|error| panic!("{}{place}: {error}", entry.name));
        places.insert(format!("{}{place}", entry.name));
    }
    for expected in [
        "fault-transition/kind",
        "fault-transition/state",
        "fault-transition/symptom",
        "fault-transition/doubt",
        "fault-transition/condition/agreement",
        "fault-transition/order/order",
        "fault-transition/state_order/order",
        "history-page/transitions/0/state",
        "input/taken/input",
        "module-status/phase",
        "module-status/peers/0/latest",
        "obeyed/state",
        "phase-change/phase",
        "phase-change/before",
        "plant-status/phase",
        "plant-status/faults/0/fault/kind",
    ] {
        assert!(places.contains(expected), "{expected} is not among {places:#?}");
    }
}

#[test]
fn what_is_written_again_is_no_healthier() {
    let entry = for_readers().find(|entry| entry.name == "fault-transition").unwrap();
    let states = ["normal", "unknown", "tentative", "unconfirmed", "explained", "latched"];
    for state in states.into_iter().chain(["acknowledged", LATER]) {
        let mut message = example(&entry);
        message["state"] = json!(state);
        for place in ["/kind", "/symptom", "/doubt", "/condition/agreement", "/order/order"] {
            let mut later = message.clone();
            *later.pointer_mut(place).unwrap() = json!(LATER);
            let read = transition(&later);
            let expected = if state == LATER { "unknown" } else { state };
            assert_eq!(read.state.as_str(), expected, "{place}");
            let again = transition(&serde_json::from_slice(&wire::encode(&read).unwrap()).unwrap());
            assert_eq!(again, read, "{place}");
        }
    }
}

#[test]
fn a_later_state_is_unknown_and_a_later_agreement_verifies_nothing() {
    let entry = for_readers().find(|entry| entry.name == "fault-transition").unwrap();
    let mut message = example(&entry);
    message["state"] = json!(LATER);
    let read = transition(&message);
    assert!(read.state == FaultState::Unknown && !read.state.is_fault());
    message["state"] = json!("normal");
    assert!(transition(&message).is_verified());
    message["condition"]["agreement"] = json!(LATER);
    let read = transition(&message);
    assert!(!read.is_verified() && !read.condition.unwrap().agreement.allows_normal());
}

#[test]
fn a_later_phase_is_not_in_service() {
    let entry = for_readers().find(|entry| entry.name == "phase-change").unwrap();
    let mut message = example(&entry);
    message["phase"] = json!(LATER);
    let read: PhaseChange = decode(message.to_string().as_bytes()).unwrap();
    assert_ne!(read.phase, ModulePhase::InService);
}

#[test]
fn what_a_process_is_to_do_is_not_guessed() {
    let injection = json!({"v": 1, "component": "m/sensor/g", "fault": {"kind": LATER}});
    assert!(decode::<Injection>(injection.to_string().as_bytes()).is_err());
    for topic in [LATER, "other"] {
        let key = format!("trusswatch/tower/module1/command/{topic}");
        assert!(key.parse::<Key>().is_err(), "{key}");
        let key = format!("trusswatch/tower/module1/fault/{topic}/g1");
        assert!(key.parse::<Key>().is_err(), "{key}");
    }
}

#[test]
fn the_schemas_take_the_words_that_the_programs_take() {
    for name in ["FaultState", "Symptom", "Doubt", "Agreement", "OrderKind", "ComponentKind"] {
        let entry = for_readers().find(|entry| entry.name == "fault-transition").unwrap();
        let schema = entry.schema()["$defs"][name].clone();
        let takes = schema["anyOf"].as_array().unwrap();
        let open = takes.iter().filter(|one| one["type"] == "string" && one.get("const").is_none());
        assert_eq!(open.count(), 1, "{name}: {schema:#}");
        assert!(takes.iter().all(|one| one["description"].is_string()), "{name}: {schema:#}");
        assert!(takes.iter().all(|one| one["const"] != "other"), "{name}: {schema:#}");
    }
}

#[test]
fn an_input_of_a_later_version_is_none_of_this_one() {
    let entry = for_readers().find(|entry| entry.name == "input").unwrap();
    let mut message = example(&entry);
    message["taken"]["input"] = json!(LATER);
    message["taken"]["more"] = json!({"of": [1, 2.5, null]});
    message["besides"] = json!(LATER);
    let input: Input = decode(message.to_string().as_bytes()).unwrap();
    assert_eq!((input.taken, input.number), (Taken::Other, 7));
}
