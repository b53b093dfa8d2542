//! Differences between a replay and a recording.

use std::fmt;

use serde::Serialize;
use serde_json::Value;
use vocabulary::{Component, ModuleName, RunId, Step};

/// The first field in which a replay and a recording differ.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// The module.
    #[serde(skip)]
    pub module: ModuleName,
    /// The run.
    pub run: RunId,
    /// The step.
    pub step: Step,
    /// The component.
    pub component: Component,
    /// The field.
    pub field: String,
    /// As recorded; JSON.
    pub recorded: String,
    /// As replayed; JSON.
    pub replayed: String,
}

/// A field with its recorded and its replayed value.
pub(crate) type FieldValues = (String, String, String);

impl Difference {
    pub(crate) fn new(
        module: &ModuleName,
        (run, step): (RunId, Step),
        component: &Component,
        (field, recorded, replayed): FieldValues,
    ) -> Self {
        let (module, component) = (module.clone(), component.clone());
        Self { module, run, step, component, field, recorded, replayed }
    }

    /// A message that is in the recording or in the replay, but not in both.
    pub(crate) fn of_presence(
        module: &ModuleName,
        at: (RunId, Step),
        component: &Component,
        (message, recorded, replayed): (&str, &str, &str),
    ) -> Self {
        let fields = (message.to_owned(), recorded.to_owned(), replayed.to_owned());
        Self::new(module, at, component, fields)
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { module, run, step, component, field, recorded, replayed } = self;
        write!(
            f,
            "{module}/{component} at step {step} of run {run}: {field} is {recorded} in the recording, {replayed} in the replay"
        )
    }
}

/// The first field in which two objects differ, with both values. Numbers are the same if all their bits are.
pub(crate) fn first_field(recorded: &Value, replayed: &Value) -> Option<FieldValues> {
    let inside = |name: &dyn fmt::Display, recorded: &Value, replayed: &Value| {
        let (inner, recorded, replayed) = first_field(recorded, replayed)?;
        let path = if inner.is_empty() { name.to_string() } else { format!("{name}.{inner}") };
        Some((path, recorded, replayed))
    };
    match (recorded, replayed) {
        (Value::Object(one), Value::Object(other)) => {
            let names = one.keys().chain(other.keys().filter(|name| !one.contains_key(*name)));
            names.into_iter().find_map(|name| {
                let value =
                    |of: &serde_json::Map<String, Value>| of.get(name).cloned().unwrap_or_default();
                inside(name, &value(one), &value(other))
            })
        }
        (Value::Array(one), Value::Array(other)) if one.len() == other.len() => {
            let mut pairs = one.iter().zip(other).enumerate();
            pairs.find_map(|(place, (one, other))| inside(&place, one, other))
        }
        _ => {
            let (one, other) = (recorded.to_string(), replayed.to_string());
            (one != other).then(|| (String::new(), one, other))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn the_first_field_that_differs_is_named() {
        let one = json!({ "a": 1.0, "b": { "c": 0.0, "d": null } });
        assert_eq!(first_field(&one, &one), None);
        let other = json!({ "a": 1.0, "b": { "c": -0.0, "d": null } });
        let wanted = Some(("b.c".to_owned(), "0.0".to_owned(), "-0.0".to_owned()));
        assert_eq!(first_field(&one, &other), wanted);
        let of_list = json!({ "a": 1.0, "b": [{ "c": 2 }, { "c": 4 }] });
        let changed = json!({ "a": 1.0, "b": [{ "c": 2 }, { "c": 5 }] });
        assert_eq!(first_field(&of_list, &changed).unwrap().0, "b.1.c");
        let less = json!({ "a": 1.0 });
        assert_eq!(first_field(&less, &one).unwrap().0, "b");
    }
}
