//! Mistakes in configuration files.

use std::fmt;
use std::path::{Path, PathBuf};

/// Problems quote the file, whose content is arbitrary.
const LONGEST_PROBLEM: usize = 1000;

/// One mistake.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConfigError {
    /// The file.
    pub file: PathBuf,
    /// Line in it, counted from 1, if known.
    pub line: Option<usize>,
    /// What is wrong and what would be right.
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

/// Every mistake that was found; at least one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConfigErrors(pub Vec<ConfigError>);

impl ConfigErrors {
    /// One mistake.
    pub fn one(file: &Path, line: Option<usize>, problem: impl fmt::Display) -> Self {
        let problem = vocabulary::quotation(&problem.to_string(), LONGEST_PROBLEM);
        Self(vec![ConfigError { file: file.to_owned(), line, problem }])
    }

    /// `value` if nothing was found, else everything that was.
    ///
    /// # Errors
    /// Everything that was found.
    pub fn or<T>(self, value: T) -> Result<T, ConfigErrors> {
        if self.0.is_empty() { Ok(value) } else { Err(self) }
    }

    /// One mistake more.
    pub fn add(&mut self, file: &Path, line: Option<usize>, problem: impl fmt::Display) {
        self.0.extend(Self::one(file, line, problem).0);
    }

    /// The value of a result, its mistakes being added to these.
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
