//! The output of commands: text, or JSON objects that, like messages, begin with the version of their format.

use std::io::{self, IsTerminal, StdoutLock, Write};

use serde::Serialize;
use serde_json::Value;
use vocabulary::{VERSION, in_ascii};

use crate::failure::Failure;

/// Prints text on standard output and flushes it.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut out = stdout();
    out.write_all(text.as_bytes())?;
    Ok(out.flush()?)
}

/// Standard output; on a terminal without UTF-8, in ASCII.
pub(crate) fn stdout() -> Stdout {
    Stdout { lock: io::stdout().lock(), is_ascii: is_ascii_terminal() }
}

/// Whether standard output is a terminal whose locale says that it has no UTF-8. Files and pipes get UTF-8.
pub(crate) fn is_ascii_terminal() -> bool {
    let locale = ["LC_ALL", "LC_CTYPE", "LANG"].map(|name| std::env::var(name).ok());
    io::stdout().is_terminal() && lacks_utf8(locale)
}

/// By the first variable that is set and not empty (POSIX, Base Definitions, section 8.2). Without one nothing is said:
/// containers seldom set any.
fn lacks_utf8(variables: [Option<String>; 3]) -> bool {
    let mut set = variables.into_iter().flatten().filter(|locale| !locale.is_empty());
    let is_utf8 = |locale: String| locale.to_ascii_lowercase().replace('-', "").contains("utf8");
    set.next().is_some_and(|locale| !is_utf8(locale))
}

/// See [`stdout`].
pub(crate) struct Stdout {
    lock: StdoutLock<'static>,
    is_ascii: bool,
}

impl Write for Stdout {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.is_ascii {
            let text: String = String::from_utf8_lossy(bytes).chars().map(in_ascii).collect();
            self.lock.write_all(text.as_bytes())?;
            return Ok(bytes.len());
        }
        self.lock.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.lock.flush()
    }
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
    fn the_first_variable_that_is_set_says_whether_the_terminal_has_utf_8() {
        let lacks = |all: &str, ctype: &str, lang: &str| {
            lacks_utf8([all, ctype, lang].map(|text| (text != "-").then(|| text.to_owned())))
        };
        for (all, ctype, lang) in [
            ("C", "-", "-"),
            ("POSIX", "en_US.UTF-8", "-"),
            ("", "-", "de_DE"),
            ("-", "C", "C.UTF-8"),
        ] {
            assert!(lacks(all, ctype, lang), "{all} {ctype} {lang}");
        }
        for (all, ctype, lang) in
            [("-", "-", "-"), ("C.UTF-8", "C", "C"), ("", "", "de_DE.utf8"), ("-", "C.utf-8", "C")]
        {
            assert!(!lacks(all, ctype, lang), "{all} {ctype} {lang}");
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
