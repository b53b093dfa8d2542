//! The documentation of the messages for other programs is true.
#![expect(clippy::unwrap_used, reason = "helpers of tests fail loudly")]

mod support;

use std::collections::BTreeSet;

use serde_json::{Value, json};
use support::{plain_topics, plant_topics};
use vocabulary::{
    DecodeError, Key, Topic,
    catalogue::{Entry, Travels, catalogue},
};

fn example(entry: &Entry) -> Value {
    serde_json::from_str(entry.example()).unwrap()
}

fn entry(name: &str) -> Entry {
    catalogue().into_iter().find(|entry| entry.name == name).unwrap()
}

fn refused(name: &str, message: &Value) -> DecodeError {
    entry(name).check(message.to_string().as_bytes()).unwrap_err()
}

/// The schema of an object and, of several that it may be besides, of the one that this example is.
fn parts<'a>(schema: &'a Value, example: &Value) -> Vec<&'a Value> {
    let is_meant = |variant: &&Value| {
        let mut properties = variant["properties"].as_object().unwrap().iter();
        properties
            .all(|(name, property)| property.get("const").is_none_or(|word| *word == example[name]))
    };
    let variants = schema["oneOf"].as_array().into_iter().flatten();
    std::iter::once(schema).chain(variants.filter(is_meant)).collect()
}

#[test]
fn every_example_is_a_message_and_shows_every_field() {
    for entry in catalogue() {
        let name = entry.name;
        entry.check(entry.example().as_bytes()).unwrap_or_else(|error| panic!("{name}: {error}"));
        let schema = entry.schema();
        assert_eq!(schema["examples"], json!([example(&entry)]));
        let fields = |value: &Value| -> BTreeSet<String> {
            value.as_object().unwrap().keys().cloned().collect()
        };
        let example = example(&entry);
        let parts = parts(&schema, &example);
        let shown = parts.iter().flat_map(|part| fields(&part["properties"])).collect();
        assert_eq!(fields(&example), shown, "{name}");
    }
}

#[test]
fn a_required_field_that_is_missing_is_refused_and_another_one_is_not() {
    for entry in catalogue() {
        let whole = example(&entry);
        let schema = entry.schema();
        let parts = parts(&schema, &whole);
        let required: Vec<&Value> =
            parts.iter().flat_map(|part| part["required"].as_array().unwrap()).collect();
        for field in whole.as_object().unwrap().keys() {
            let mut less = whole.clone();
            less.as_object_mut().unwrap().remove(field);
            let taken = entry.check(less.to_string().as_bytes()).is_ok();
            let wanted = required.contains(&&json!(field));
            assert_ne!(taken, wanted, "{} without `{field}`", entry.name);
        }
    }
}

#[test]
fn another_version_and_a_value_of_another_type_are_refused() {
    for entry in catalogue() {
        let mut later = example(&entry);
        later["v"] = json!(2);
        assert_eq!(refused(entry.name, &later), DecodeError::UnknownVersion("2".into()));
    }
    let mut sample = example(&entry("sample"));
    sample["elongations_m"][0] = json!("11 µm");
    assert!(matches!(refused("sample", &sample), DecodeError::WrongMessage { .. }));
}

#[test]
fn every_type_and_field_of_a_schema_is_described() {
    for entry in catalogue() {
        let schema = entry.schema();
        assert!(schema["description"].is_string(), "{}", entry.name);
        let types = schema["$defs"].as_object().into_iter().flatten().map(|(_, named)| named);
        for named in types.chain([&schema]) {
            for (field, property) in named["properties"].as_object().into_iter().flatten() {
                assert!(property["description"].is_string(), "{}: {field}", entry.name);
            }
        }
    }
}

/// The topics of all keys, written as the manual does.
fn topics() -> BTreeSet<String> {
    let components = || ["actuator/name", "sensor/name"].map(|name| name.parse().unwrap());
    let of_components =
        components().map(Topic::Fault).into_iter().chain(components().map(Topic::Identification));
    let module = plain_topics().into_iter().chain(of_components);
    let of_module = module.map(|topic| format!("{{module}}/{topic}"));
    let of_plant = plant_topics().into_iter().map(|topic| format!("plant/{topic}"));
    of_module
        .chain(of_plant)
        .map(|key| key.replace("/name", "/{name}").replace("/ada", "/{operator}"))
        .collect()
}

/// Liveliness tokens are no messages.
fn is_token(key: &str) -> bool {
    key.ends_with("/alive")
}

#[test]
fn messages_travel_on_the_keys_that_there_are_and_on_each_of_them() {
    let documented: BTreeSet<String> = catalogue()
        .iter()
        .flat_map(|entry| entry.travels)
        .map(|(key, _)| (*key).to_owned())
        .collect();
    let expected = topics().into_iter().filter(|key| !is_token(key)).collect();
    assert_eq!(documented, expected);
    for key in documented {
        let key =
            key.replace("{module}", "module1").replace("{name}", "x1").replace("{operator}", "ada");
        let key = format!("trusswatch/tower/{key}");
        assert!(key.parse::<Key>().is_ok(), "{key}");
    }
}

#[test]
fn the_manuals_table_of_keys_has_every_key_and_no_other() {
    let manual = concat!(env!("CARGO_MANIFEST_DIR"), "/README.md");
    let manual = std::fs::read_to_string(manual).unwrap();
    let (_, section) = manual.split_once("\n## Keys\n").unwrap();
    let rows = section.lines().skip_while(|line| !line.starts_with('|'));
    let cells = rows.take_while(|line| line.starts_with('|')).map(|row| row.split('|').nth(1));
    let documented: BTreeSet<String> = cells
        .flat_map(|cell| cell.unwrap().split('`').skip(1).step_by(2))
        .map(ToOwned::to_owned)
        .collect();
    assert_eq!(documented, topics());
}

#[test]
fn a_query_with_a_message_has_a_reply_with_one() {
    for entry in catalogue() {
        for (key, _) in entry.travels.iter().filter(|(_, travels)| *travels == Travels::Querying) {
            let replied = catalogue().iter().any(|e| e.travels.contains(&(key, Travels::Replying)));
            assert!(replied, "{key}");
        }
    }
}

/// Others have written programs by them. `BLESS=1` rewrites the file, so that a change is meant and shows.
#[test]
fn the_schemas_are_those_that_were_agreed_on() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/schemas.json");
    let schemas = catalogue().into_iter().map(|entry| (entry.name.to_owned(), entry.schema()));
    let present = Value::Object(schemas.collect());
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(file, format!("{present:#}\n")).unwrap();
    }
    let agreed: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    for (name, schema) in agreed.as_object().unwrap() {
        assert_eq!(present.get(name), Some(schema), "{name}");
    }
    assert_eq!(present, agreed);
}
