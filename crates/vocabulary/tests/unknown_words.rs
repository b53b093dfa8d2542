//! A message with a word that is not known is refused, wherever the word stands; a field that is not known is ignored.
#![expect(clippy::unwrap_used, reason = "helpers of tests fail loudly")]

use std::collections::BTreeSet;

use serde_json::{Value, json};
use vocabulary::{
    DecodeError,
    catalogue::{Entry, catalogue},
};

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
        Value::Object(fields) => fields.iter().for_each(|(name, inner)| {
            places(inner, words, &format!("{at}/{name}"), found);
        }),
        Value::Array(items) => items.iter().enumerate().for_each(|(place, inner)| {
            places(inner, words, &format!("{at}/{place}"), found);
        }),
        _ => {}
    }
}

fn example(entry: &Entry) -> Value {
    serde_json::from_str(entry.example()).unwrap()
}

#[test]
fn a_word_that_is_not_known_makes_a_message_unreadable() {
    let mut seen = BTreeSet::new();
    for entry in catalogue() {
        let (mut known, mut found) = (BTreeSet::new(), Vec::new());
        words(&entry.schema(), &mut known);
        places(&example(&entry), &known, "", &mut found);
        for place in found {
            // Nor is a number a word.
            for unknown in [json!("an_unknown_word"), json!(0)] {
                let mut message = example(&entry);
                *message.pointer_mut(&place).unwrap() = unknown;
                let error = entry.check(message.to_string().as_bytes()).unwrap_err();
                assert!(matches!(error, DecodeError::WrongMessage { .. }), "{}{place}", entry.name);
            }
            seen.insert(format!("{}{place}", entry.name));
        }
    }
    for expected in [
        "fault-transition/state",
        "fault-transition/symptom",
        "fault-transition/condition/agreement",
        "history-page/transitions/0/state",
        "input/taken/input",
        "module-status/phase",
        "phase-change/phase",
        "plant-status/faults/0/fault/kind",
    ] {
        assert!(seen.contains(expected), "{expected} is not among {seen:#?}");
    }
}

#[test]
fn a_field_that_is_not_known_is_ignored() {
    for entry in catalogue() {
        let mut message = example(&entry);
        message["an_unknown_field"] = json!({"of": [1, 2.5, null]});
        assert_eq!(entry.check(message.to_string().as_bytes()), Ok(()), "{}", entry.name);
    }
}
