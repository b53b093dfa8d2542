//! Parses settings files: TOML into types; reports all errors at once, each with its line.

use std::fmt;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// No setting is larger, whatever its unit.
const LARGEST: f64 = 1e15;

/// A file with its text, kept so that errors found later can name a line.
#[derive(Debug, Clone)]
pub struct SettingsFile {
    /// The file.
    pub file: PathBuf,
    /// The content.
    pub text: String,
}

impl SettingsFile {
    /// Reads a file.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn read(file: &Path) -> Result<Self, ConfigErrors> {
        let bytes = std::fs::read(file)
            .map_err(|error| format!("cannot be read: {error}{}", did_you_mean(file)))
            .map_err(|problem| ConfigErrors::one(file, None, problem))?;
        let text = String::from_utf8(bytes).map_err(|error| {
            let (at, bytes) = (error.utf8_error().valid_up_to(), error.as_bytes());
            let line = bytes[..at].iter().filter(|byte| **byte == b'\n').count() + 1;
            let column =
                at - bytes[..at].iter().rposition(|b| *b == b'\n').map_or(0, |end| end + 1);
            let problem = format!(
                "byte {:#04x} at place {} of the line is not UTF-8; save the file as UTF-8",
                bytes[at],
                column + 1
            );
            ConfigErrors::one(file, Some(line), problem)
        })?;
        Ok(Self { file: file.to_owned(), text })
    }

    /// Parses the content. A key that is unknown, missing or of the wrong type is an error.
    ///
    /// # Errors
    /// The first error.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, ConfigErrors> {
        toml::from_str(&self.text).map_err(|error| {
            let span = error.span();
            let line = span.as_ref().map(|span| line_at(&self.text, span.start));
            let key = span.and_then(|span| key_before(&self.text, span.start));
            let message = error.message();
            let problem = match key.filter(|_| message.starts_with("invalid")) {
                Some(key) => format!("`{key}`: {message}"),
                None => message.to_owned(),
            };
            ConfigErrors::one(&self.file, line, problem)
        })
    }

    /// Adds each number that no setting can have, unless its line has an error already. To be called last: what is known of
    /// a setting says more.
    pub fn check_numbers(&self, errors: &mut ConfigErrors) {
        if let Ok(table) = DeTable::parse(&self.text) {
            let entries = table.get_ref().iter();
            entries.for_each(|(key, value)| self.check_number(key.get_ref(), value, errors));
        }
    }

    /// Infinity may be a setting: it means never.
    fn check_number(&self, key: &str, value: &Spanned<DeValue<'_>>, errors: &mut ConfigErrors) {
        match value.get_ref() {
            DeValue::Float(number) => {
                let text = number.as_str();
                let number = text.parse::<f64>().unwrap_or(0.0);
                let is_setting = number.abs() <= LARGEST || number == f64::INFINITY;
                if is_setting {
                    return;
                }
                let line = Some(line_at(&self.text, value.span().start));
                if !errors.0.iter().any(|e| e.line == line && e.file == self.file) {
                    let least = -LARGEST;
                    let problem =
                        format!("`{key}` is {text}; use a number from {least:e} to {LARGEST:e}");
                    errors.add(&self.file, line, problem);
                }
            }
            DeValue::Array(values) => {
                values.iter().for_each(|value| self.check_number(key, value, errors));
            }
            DeValue::Table(table) => {
                table
                    .iter()
                    .for_each(|(key, value)| self.check_number(key.get_ref(), value, errors));
            }
            _ => {}
        }
    }

    /// Whether the file has a key at this path of tables.
    #[must_use]
    pub fn has(&self, path: &[&str]) -> bool {
        let parsed = DeTable::parse(&self.text).ok();
        let mut table = parsed.as_ref().map(|table| table.get_ref());
        path.iter().all(|wanted| {
            let entry = table.and_then(|table| table.get(*wanted));
            table = entry.and_then(|value| value.get_ref().as_table());
            entry.is_some()
        })
    }

    /// The line of the key at this path of tables, or of the nearest enclosing table.
    #[must_use]
    pub fn line(&self, path: &[&str]) -> Option<usize> {
        let parsed = DeTable::parse(&self.text).ok()?;
        let mut table = parsed.get_ref();
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

    /// Resolves a path in this file relative to the file's directory.
    #[must_use]
    pub fn beside(&self, path: &Path) -> PathBuf {
        self.file.parent().map_or_else(|| path.to_owned(), |folder| folder.join(path))
    }
}

/// Largest number of letters in which a name that was meant differs from one that does not exist.
const SIMILAR: usize = 2;

/// The file beside one that does not exist whose name is most like it, as the end of an error; empty without one.
#[must_use]
pub fn did_you_mean(file: &Path) -> String {
    let Some(wanted) = file.file_name().filter(|_| !file.exists()) else { return String::new() };
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
    let entries = std::fs::read_dir(folder.unwrap_or(Path::new("."))).into_iter().flatten();
    let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let wanted = wanted.to_string_lossy();
    let distances = names.map(|name| (strsim::osa_distance(&name, &wanted), name));
    match distances.filter(|(distance, _)| *distance <= SIMILAR).min() {
        Some((_, name)) => format!("; did you mean `{}`?", file.with_file_name(name).display()),
        None => String::new(),
    }
}

/// The key of the value at an offset, if it stands on the same line.
fn key_before(text: &str, offset: usize) -> Option<&str> {
    let line = text.get(..offset)?.rsplit('\n').next()?;
    let before = line.rsplit_once('=')?.0.trim_end();
    before.rsplit([' ', ',', '{', '.']).next().filter(|key| !key.is_empty())
}

fn line_at(text: &str, offset: usize) -> usize {
    text.bytes().take(offset).filter(|byte| *byte == b'\n').count() + 1
}

/// Problems quote the file, whose content is arbitrary.
const LONGEST_PROBLEM: usize = 1000;

/// A configuration error.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConfigError {
    /// The file.
    pub file: PathBuf,
    /// The line, counted from 1, if known.
    pub line: Option<usize>,
    /// What is wrong, and what is expected.
    pub problem: String,
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        write!(f, ": {}", self.problem)
    }
}

impl std::error::Error for ConfigError {}

/// All errors found; at least one when returned.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConfigErrors(pub Vec<ConfigError>);

impl ConfigErrors {
    /// A single error.
    pub fn one(file: &Path, line: Option<usize>, problem: impl fmt::Display) -> Self {
        let problem = vocabulary::quotation(&problem.to_string(), LONGEST_PROBLEM);
        Self(vec![ConfigError { file: file.to_owned(), line, problem }])
    }

    /// `value` if there are no errors.
    ///
    /// # Errors
    /// All errors found.
    pub fn or<T>(self, value: T) -> Result<T, ConfigErrors> {
        if self.0.is_empty() { Ok(value) } else { Err(self) }
    }

    /// Adds an error.
    pub fn add(&mut self, file: &Path, line: Option<usize>, problem: impl fmt::Display) {
        self.0.extend(Self::one(file, line, problem).0);
    }

    /// The value of a result; its errors are added to these.
    pub fn collect<T>(&mut self, result: Result<T, ConfigErrors>) -> Option<T> {
        result.map_err(|errors| self.0.extend(errors.0)).ok()
    }
}

impl fmt::Display for ConfigErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, error) in self.0.iter().enumerate() {
            if index > 0 {
                writeln!(f)?;
            }
            write!(f, "{error}")?;
        }
        Ok(())
    }
}

impl std::error::Error for ConfigErrors {}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    #[test]
    fn a_number_that_no_setting_has_is_named() {
        let file = |text: &str| SettingsFile { file: "x.toml".into(), text: text.into() };
        let said = |text: &str| {
            let mut errors = ConfigErrors(Vec::new());
            file(text).check_numbers(&mut errors);
            errors.to_string()
        };
        let range = "use a number from -1e15 to 1e15";
        let refused = format!("x.toml:2: `c` is nan; {range}\nx.toml:3: `d` is -1e300; {range}");
        assert_eq!(said("a = 1.0\nb = { c = [1.0, nan] }\nd = -1e300"), refused);
        assert_eq!(said("a = -inf"), format!("x.toml:1: `a` is -inf; {range}"));
        assert_eq!(said("a = inf"), "");
        let error = file("a = 1\nn = -3").parse::<BTreeMap<String, u64>>().unwrap_err().to_string();
        assert!(error.starts_with("x.toml:2: `n`: invalid value"), "{error}");
    }

    #[test]
    fn a_misspelt_file_is_answered_with_the_one_that_is_there() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("module1.toml");
        std::fs::write(&file, "a = 1").unwrap();
        let said = |name: &str| {
            SettingsFile::read(&folder.path().join(name)).map_err(|errors| errors.to_string())
        };
        assert!(said("module1.toml").is_ok());
        let meant = format!("did you mean `{}`?", file.display());
        for name in ["modul1.toml", "module1.tmol", "Module1.toml"] {
            assert!(said(name).unwrap_err().ends_with(&meant), "{:?}", said(name));
        }
        assert!(said("tower.toml").unwrap_err().ends_with("(os error 2)"));
        assert!(
            SettingsFile::read(Path::new("/")).unwrap_err().to_string().contains("cannot be read")
        );
    }

    #[test]
    fn the_line_of_a_key_is_found_inside_its_tables() {
        let text = "a = 1\n[b]\nc = 2\n[b.d]\n\n\"e/f\" = 3\n";
        let file = SettingsFile { file: "x.toml".into(), text: text.into() };
        assert_eq!(file.line(&["a"]), Some(1));
        assert_eq!(file.line(&["b", "c"]), Some(3));
        assert_eq!(file.line(&["b", "d", "e/f"]), Some(6));
        assert_eq!(file.line(&["b", "missing"]), Some(2));
        assert_eq!(file.line(&["missing"]), None);
    }
}
