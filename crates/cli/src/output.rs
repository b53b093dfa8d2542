//! The output of commands: text, or JSON objects that, like messages, begin with the version of their format.

use std::io::{self, Write};

use serde::Serialize;
use serde_json::Value;
use vocabulary::VERSION;

use crate::failure::Failure;

/// Prints text on standard output and flushes it.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())?;
    Ok(out.flush()?)
}

/// An object with its version.
#[derive(Serialize)]
struct VersionedDocument<'a, D> {
    v: u64,
    #[serde(flatten)]
    document: &'a D,
}

/// The object on several lines, with a line end.
pub(crate) fn text<D: Serialize>(document: &D) -> Result<String, serde_json::Error> {
    Ok(escaped(serde_json::to_string_pretty(&VersionedDocument { v: VERSION, document })?) + "\n")
}

/// The object on one line, with a line end.
pub(crate) fn line<D: Serialize>(document: &D) -> Result<String, serde_json::Error> {
    Ok(escaped(serde_json::to_string(&VersionedDocument { v: VERSION, document })?) + "\n")
}

/// Terminals obey the control characters U+007F to U+009F, which JSON permits in strings unescaped.
fn escaped(json: String) -> String {
    let is_control = |c: char| ('\u{7f}'..='\u{9f}').contains(&c);
    if !json.contains(is_control) {
        return json;
    }
    let escape = |c: char| match is_control(c) {
        true => format!("\\u{:04x}", u32::from(c)),
        false => c.to_string(),
    };
    json.chars().map(escape).collect()
}

#[derive(Serialize)]
struct Extended<M> {
    #[serde(flatten)]
    message: M,
    #[serde(flatten)]
    fields: Value,
}

/// The message with additional fields, given as an object.
pub(crate) fn with<M: Serialize>(message: M, fields: Value) -> impl Serialize {
    Extended { message, fields }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[derive(Serialize)]
    #[serde(tag = "news", rename_all = "snake_case")]
    enum News {
        Lost { count: u64 },
    }

    #[test]
    fn control_characters_are_escaped_and_read_back() {
        let note = json!({ "note": "\u{9b}31m\u{7f} µ\u{1b}" });
        for json in [text(&note).unwrap(), line(&note).unwrap()] {
            assert!(json.contains("\\u009b31m\\u007f µ\\u001b"), "{json}");
            let read: Value = serde_json::from_str(&json).unwrap();
            assert_eq!(read["note"], note["note"]);
        }
    }

    #[test]
    fn the_version_stands_first_whatever_follows() {
        let news = News::Lost { count: 3 };
        assert_eq!(line(&news).unwrap(), "{\"v\":1,\"news\":\"lost\",\"count\":3}\n");
        assert!(text(&news).unwrap().starts_with("{\n  \"v\": 1,\n  \"news\""));
        let with_time = line(&with(&news, json!({ "time": 7 }))).unwrap();
        assert_eq!(with_time, "{\"v\":1,\"news\":\"lost\",\"count\":3,\"time\":7}\n");
    }
}
