//! JSON Schema of messages, for programs that do not share these types.
//!
//! A schema says what [`crate::decode`] takes, not only what is sent: a field that may be left out is not
//! required. Of what [`crate::decode`] refuses, no schema can tell a field given twice, a whole number
//! written with a decimal point, and a message of more than [`crate::MAX_MESSAGE_BYTES`].

use schemars::Schema;
use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use serde_json::{Value, json};

use crate::encoding::{Message, VERSION};

/// The schema of a message with its version, draft 2020-12.
///
/// ```
/// let schema = vocabulary::schema::<vocabulary::Progress>();
/// assert_eq!(schema["required"], serde_json::json!(["v", "run", "step"]));
/// ```
#[must_use]
pub fn schema<M: Message>() -> Value {
    let settings = SchemaSettings::draft2020_12()
        .for_deserialize()
        .with_transform(RecursiveTransform(tell_plainly))
        .with_transform(RecursiveTransform(bound))
        .with_transform(add_version);
    settings.into_generator().into_root_schema_for::<M>().to_value()
}

/// Descriptions are comments of the code: their lines are broken and their brackets escaped for its sake.
fn tell_plainly(schema: &mut Schema) {
    if let Some(Value::String(description)) = schema.get_mut("description") {
        let paragraphs = description.split("\n\n").map(|paragraph| paragraph.replace('\n', " "));
        let whole = paragraphs.collect::<Vec<_>>().join("\n\n");
        *description = whole.replace("\\[", "[").replace("\\]", "]");
    }
}

/// A whole number has 64 bits.
fn bound(schema: &mut Schema) {
    if schema.get("format") == Some(&json!("uint64")) {
        schema.insert("maximum".to_owned(), json!(u64::MAX));
    }
}

/// What [`crate::encode`] writes before the fields.
fn add_version(schema: &mut Schema) {
    if let Some(Value::Object(properties)) = schema.get_mut("properties") {
        let version = json!({
            "description": "Version of the format.",
            "type": "integer",
            "const": VERSION,
        });
        properties.insert("v".to_owned(), version);
    }
    if let Some(Value::Array(required)) = schema.get_mut("required") {
        required.insert(0, json!("v"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FaultTransition, Injection, ModuleStatus, Sample};

    #[test]
    fn the_version_is_required_and_is_the_one_that_is_read() {
        let schema = schema::<Sample>();
        assert_eq!(schema["properties"]["v"]["const"], VERSION);
        assert_eq!(schema["required"][0], "v");
    }

    #[test]
    fn units_stand_in_the_descriptions_as_a_person_writes_them() {
        let schema = schema::<Sample>();
        let description = &schema["properties"]["pressures_pa"]["description"];
        assert_eq!(*description, "Pressures of chambers A and B of each actuator [Pa].");
        assert!(!schema.to_string().contains("\\\\["), "{schema}");
    }

    #[test]
    fn what_may_be_left_out_is_not_required() {
        let schema = schema::<FaultTransition>();
        let required = schema["required"].as_array().unwrap();
        assert!(required.contains(&json!("sequence")), "{required:?}");
        for optional in ["evidence", "identification", "order", "tare"] {
            assert!(!required.contains(&json!(optional)), "{required:?}");
        }
    }

    #[test]
    fn a_repair_is_null_and_must_be_said() {
        let schema = schema::<Injection>();
        assert_eq!(schema["required"], json!(["v", "component", "fault"]));
        assert!(schema["properties"]["fault"].to_string().contains("null"));
    }

    #[test]
    fn names_and_whole_numbers_have_bounds() {
        let schema = schema::<ModuleStatus>();
        let names = &schema["$defs"]["ModuleName"]["pattern"];
        assert_eq!(*names, "^[A-Za-z0-9_][A-Za-z0-9_-]{0,63}$");
        assert_eq!(schema["properties"]["latched"]["maximum"], u64::MAX);
        assert_eq!(schema["properties"]["latched"]["minimum"], 0);
    }
}
