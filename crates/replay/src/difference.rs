//! Where a replay and a recording differ.

use std::fmt;

use serde::Serialize;
use serde_json::Value;
use vocabulary::{Component, ModuleName, RunId, Step};

/// A difference.
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
    /// What of it.
    pub field: String,
    /// As recorded; JSON.
    pub recorded: String,
    /// As replayed; JSON.
    pub replayed: String,
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
pub(crate) fn first_field(recorded: &Value, replayed: &Value) -> Option<(String, String, String)> {
    let (Value::Object(one), Value::Object(other)) = (recorded, replayed) else {
        let (one, other) = (recorded.to_string(), replayed.to_string());
        return (one != other).then(|| (String::new(), one, other));
    };
    let names = one.keys().chain(other.keys().filter(|name| !one.contains_key(*name)));
    names.into_iter().find_map(|name| {
        let value = |of: &serde_json::Map<String, Value>| of.get(name).cloned().unwrap_or_default();
        let (inner, recorded, replayed) = first_field(&value(one), &value(other))?;
        let path = if inner.is_empty() { name.clone() } else { format!("{name}.{inner}") };
        Some((path, recorded, replayed))
    })
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
        let less = json!({ "a": 1.0 });
        assert_eq!(first_field(&less, &one).unwrap().0, "b");
    }
}
