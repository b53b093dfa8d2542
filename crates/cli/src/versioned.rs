//! Output for machines: JSON objects that begin with the version of their format, as messages do.

use serde::Serialize;
use vocabulary::VERSION;

/// An object and its version.
#[derive(Serialize)]
struct Versioned<'a, D> {
    v: u64,
    #[serde(flatten)]
    document: &'a D,
}

impl<'a, D: Serialize> Versioned<'a, D> {
    fn of(document: &'a D) -> Self {
        Self { v: VERSION, document }
    }
}

/// The object on lines of its own, with a line end.
pub(crate) fn text<D: Serialize>(document: &D) -> Result<String, serde_json::Error> {
    Ok(serde_json::to_string_pretty(&Versioned::of(document))? + "\n")
}

/// The object on one line, with a line end.
pub(crate) fn line<D: Serialize>(document: &D) -> Result<String, serde_json::Error> {
    Ok(serde_json::to_string(&Versioned::of(document))? + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Serialize)]
    #[serde(tag = "news", rename_all = "snake_case")]
    enum News {
        Lost { count: u64 },
    }

    #[test]
    fn the_version_stands_first_whatever_follows() {
        let news = News::Lost { count: 3 };
        assert_eq!(line(&news).unwrap(), "{\"v\":1,\"news\":\"lost\",\"count\":3}\n");
        assert!(text(&news).unwrap().starts_with("{\n  \"v\": 1,\n  \"news\""));
    }
}
