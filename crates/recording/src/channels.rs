//! The schema of each topic.

use serde_json::json;
use vocabulary::catalogue::{Entry, Travels, catalogue};

use crate::{divergence, loss};

/// The catalogue entry of the message that is published or sent in reply on a key.
pub(crate) fn entry_of(topic: &str) -> Option<Entry> {
    let mut parts = topic.split('/').skip(2);
    let (module, rest) = (parts.next()?, parts.collect::<Vec<_>>());
    let is_one = |pattern: &str| {
        let wanted: Vec<&str> = pattern.split('/').collect();
        let of_module = wanted[0] == "{module}" && module != vocabulary::keys::PLANT;
        (of_module || wanted[0] == module)
            && wanted.len() == rest.len() + 1
            && wanted[1..].iter().zip(&rest).all(|(a, b)| a.starts_with('{') || a == b)
    };
    catalogue().into_iter().find(|entry| {
        let keys = entry.travels.iter();
        keys.filter(|(_, travels)| matches!(travels, Travels::Published | Travels::Replying))
            .any(|(pattern, _)| is_one(pattern))
    })
}

/// Name and text of the schema of a topic.
pub(crate) fn schema_of(topic: &str) -> (String, String) {
    if let Some(entry) = entry_of(topic) {
        return (entry.name.to_owned(), entry.schema().to_string());
    }
    let (name, schema) = match topic.strip_suffix(divergence::BY_COMPONENT).and_then(entry_of) {
        Some(_) => (divergence::NAME, divergence::schema()),
        None if loss::is_loss(topic) => (loss::NAME, loss::schema()),
        // Any JSON: viewers want a schema that is an object.
        None => ("json", json!({ "type": "object" })),
    };
    (name.to_owned(), schema.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_topic_has_a_schema() {
        for (topic, name) in [
            ("trusswatch/tower/module1/sample", "sample"),
            ("trusswatch/tower/module1/fault/sensor/g1", "fault-transition"),
            ("trusswatch/tower/module1/input", "input"),
            ("trusswatch/tower/module1/configuration", "configuration"),
            ("trusswatch/tower/plant/status", "plant-status"),
            ("trusswatch/tower/module1/status", "module-status"),
            ("trusswatch/tower/module1/divergence", "divergences"),
            ("trusswatch/tower/module1/divergence/by-component", "divergences-by-component"),
            ("trusswatch/tower/recorder/loss", "loss"),
            ("trusswatch/tower/module1/of-a-later-version", "json"),
            ("elsewhere", "json"),
        ] {
            let (found, text) = schema_of(topic);
            assert_eq!(found, name, "{topic}");
            let schema: serde_json::Value = serde_json::from_str(&text).unwrap();
            assert!(
                schema["type"].is_string() || schema["properties"].is_object(),
                "{topic}: {text}"
            );
        }
    }
}
