//! The table `[network]` of a client, in a file whose other content is unchanged.

use std::ops::Range;
use std::path::Path;

use toml::Value;
use toml::de::{DeTable, DeValue};

const TABLE: &str = "network";

/// Replaces the table in the text.
///
/// # Errors
/// The text is not TOML, or the name belongs to something else; the error describes the problem.
pub(super) fn of_client(text: &str, router: &str, tls: &Path) -> Result<String, String> {
    let tls = tls.to_string_lossy();
    let [router, tls] = [router, &tls].map(|text| Value::from(text).to_string());
    let table = format!("[{TABLE}]\nmode = \"client\"\nconnect = [{router}]\ntls = {tls}\n");
    Ok(match place(text)? {
        Some(place) => format!("{}{table}{}", &text[..place.start], &text[place.end..]),
        None => format!("{}\n\n{table}", text.trim_end()),
    })
}

/// The range from the header of the table to the end of the line of its last value.
fn place(text: &str) -> Result<Option<Range<usize>>, String> {
    let document = DeTable::parse(text).map_err(|error| error.message().to_owned())?;
    let mut entries = document.get_ref().iter();
    let Some((key, value)) = entries.find(|(key, _)| key.get_ref() == TABLE) else {
        return Ok(None);
    };
    let start = text[..key.span().start].rfind('\n').map_or(0, |newline| newline + 1);
    let DeValue::Table(table) = value.get_ref() else {
        return Err(format!("`{TABLE}` is not a table"));
    };
    if !text[start..].starts_with('[') {
        return Err(format!("`{TABLE}` has no lines of its own; write it as a table `[{TABLE}]`"));
    }
    let last = table.values().map(|value| value.span().end).max().unwrap_or(key.span().end);
    let end = text[last..].find('\n').map_or(text.len(), |newline| last + newline + 1);
    Ok(Some(start..end))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joined(text: &str) -> Result<String, String> {
        of_client(text, "tls/192.0.2.10:7447", Path::new("/c"))
    }

    const TABLE_OF_CLIENT: &str =
        "[network]\nmode = \"client\"\nconnect = [\"tls/192.0.2.10:7447\"]\ntls = \"/c\"\n";

    #[test]
    fn nothing_but_the_table_is_changed() {
        let before = "# mine\na  =  1 # one\n\n# its peers\n";
        let old = "[network]\nzenoh = \"x\"\nlisten = [\n  \"tcp/a:1\", # here\n] # there\n";
        let text = format!("{before}{old}\n[plant]\nb = 2\n");
        let expected = format!("{before}{TABLE_OF_CLIENT}\n[plant]\nb = 2\n");
        assert_eq!(joined(&text).unwrap(), expected);
        assert_eq!(joined(&expected).unwrap(), expected);
    }

    #[test]
    fn a_table_may_be_empty_or_missing_or_last() {
        assert_eq!(joined("[network]\n[plant]\n").unwrap(), format!("{TABLE_OF_CLIENT}[plant]\n"));
        assert_eq!(joined("a = 1\n").unwrap(), format!("a = 1\n\n{TABLE_OF_CLIENT}"));
        assert_eq!(joined("[network]\nlisten = []").unwrap(), TABLE_OF_CLIENT);
    }

    #[test]
    fn what_is_no_table_is_reported() {
        assert_eq!(joined("network = 1").unwrap_err(), "`network` is not a table");
        for text in ["network = { listen = [] }", "network.listen = []"] {
            assert!(joined(text).unwrap_err().contains("write it as a table `[network]`"));
        }
        assert!(joined("a = ").is_err());
    }
}
