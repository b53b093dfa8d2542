//! A TOML file with the lines of its keys.

use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};

use crate::error::ConfigErrors;

/// A file's text, kept so that a mistake found later can still name its line.
#[derive(Debug, Clone)]
pub struct Document {
    /// The file.
    pub file: PathBuf,
    /// What it contains.
    pub text: String,
}

impl Document {
    /// Reads a file.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn read(file: &Path) -> Result<Self, ConfigErrors> {
        let text = std::fs::read_to_string(file)
            .map_err(|error| ConfigErrors::one(file, None, format!("cannot be read: {error}")))?;
        Ok(Self { file: file.to_owned(), text })
    }

    /// The content as a type; a key that is unknown, missing or of the wrong type is an error.
    ///
    /// # Errors
    /// The first mistake.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, ConfigErrors> {
        toml::from_str(&self.text).map_err(|error| {
            let line = error.span().map(|span| line_at(&self.text, span.start));
            ConfigErrors::one(&self.file, line, error.message().to_owned())
        })
    }

    /// The line of a key, given the tables it lies in; or that of the nearest of them.
    #[must_use]
    pub fn line(&self, path: &[&str]) -> Option<usize> {
        let document = DeTable::parse(&self.text).ok()?;
        let mut table = document.get_ref();
        let mut found = None;
        for wanted in path {
            let entry = table.iter().find(|(key, _)| key.get_ref() == wanted);
            let Some((key, value)) = entry else { break };
            found = Some(line_at(&self.text, key.span().start));
            match value.get_ref() {
                DeValue::Table(inner) => table = inner,
                _ => break,
            }
        }
        found
    }

    /// A path that stands in this file, seen from where the file lies.
    #[must_use]
    pub fn beside(&self, path: &Path) -> PathBuf {
        self.file.parent().map_or_else(|| path.to_owned(), |folder| folder.join(path))
    }
}

fn line_at(text: &str, offset: usize) -> usize {
    text.bytes().take(offset).filter(|byte| *byte == b'\n').count() + 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_of_a_key_is_found_inside_its_tables() {
        let text = "a = 1\n[b]\nc = 2\n[b.d]\n\n\"e/f\" = 3\n";
        let document = Document { file: "x.toml".into(), text: text.into() };
        assert_eq!(document.line(&["a"]), Some(1));
        assert_eq!(document.line(&["b", "c"]), Some(3));
        assert_eq!(document.line(&["b", "d", "e/f"]), Some(6));
        assert_eq!(document.line(&["b", "missing"]), Some(2));
        assert_eq!(document.line(&["missing"]), None);
    }
}
