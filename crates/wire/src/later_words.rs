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
