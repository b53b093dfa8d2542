//! Words that a later version adds to an enumeration of a message.
//!
//! A reader takes the message all the same: each enumeration has a variant for the words that it does not know, which
//! claims as little as can be and is never taken for healthy. What a process is ordered or asked to do is another matter:
//! nothing of that is guessed.

use schemars::Schema;
use serde_json::{Value, json};

/// What a variant that stands for nothing but such words is called where it is written again.
const OTHER: &str = "other";

/// The schema of an enumeration whose readers take any word.
pub(crate) fn open(schema: &mut Schema) {
    let Some(Value::Array(mut words)) = schema.remove("oneOf") else { return };
    words.retain(|word| word.get("const") != Some(&json!(OTHER)));
    words.push(json!({ "description": "A word of a later version.", "type": "string" }));
    schema.insert("anyOf".to_owned(), Value::Array(words));
}

/// The schema of an enumeration with fields, distinguished by the word in the field `tag`: readers take any other word, too.
pub(crate) fn open_tagged(schema: &mut Schema, tag: &str) {
    let Some(Value::Array(variants)) = schema.get_mut("oneOf") else { return };
    let word = |variant: &Value| variant["properties"][tag]["const"].as_str().map(str::to_owned);
    let known: Vec<String> =
        variants.iter().filter_map(word).filter(|word| word != OTHER).collect();
    for variant in variants {
        if word(variant).as_deref() == Some(OTHER) {
            variant["properties"][tag] = json!({ "type": "string", "not": { "enum": known } });
        }
    }
}
