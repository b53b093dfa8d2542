//! The schema of each topic.

use serde_json::Value;
use wire::catalogue::{Entry, Travels, catalogue};

/// The message that travels on a key of trusswatch, published or in reply.
pub(crate) fn entry_of(topic: &str) -> Option<Entry> {
    let mut parts = topic.split('/').skip(2);
    let (module, rest) = (parts.next()?, parts.collect::<Vec<_>>());
    let is_one = |pattern: &str| {
        let wanted: Vec<&str> = pattern.split('/').collect();
        let of_module = wanted[0] == "{module}" && module != wire::keys::PLANT;
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
    let any = || ("json".to_owned(), Value::Object(serde_json::Map::new()).to_string());
    entry_of(topic).map_or_else(any, |entry| (entry.name.to_owned(), entry.schema().to_string()))
}
