//! Errors in a description, each with its line.

use std::fmt;

use vocabulary::{NameError, quotation};

const LONGEST_PROBLEM: usize = 1000;

/// An error in a description.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DescriptionProblem {
    /// Invalid TOML, or a key missing, unknown or of the wrong type.
    #[error("{0}")]
    Format(String),
    /// A text that cannot be a name.
    #[error(transparent)]
    Name(#[from] NameError),
    /// A reference to an unknown name.
    #[error("{user} refers to {what} `{name}`, which is not described; {hint}")]
    Unknown {
        /// The entry that refers to it.
        user: String,
        /// The kind of entry that is missing.
        what: &'static str,
        /// The name.
        name: String,
        /// The names that exist.
        hint: String,
    },
    /// Two entries with the same name.
    #[error("{what} `{name}` is described twice{first}; give each its own name")]
    Duplicate {
        /// The kind of entry.
        what: &'static str,
        /// The name.
        name: String,
        /// The line of the first one.
        first: String,
    },
    /// A number outside its range.
    #[error("`{quantity}` of {owner} is {value:?}; use {expected}")]
    Number {
        /// The quantity.
        quantity: &'static str,
        /// The entry it belongs to.
        owner: String,
        /// The value.
        value: f64,
        /// What is expected.
        expected: String,
    },
    /// Both ends are at the same position.
    #[error(
        "{what} `{name}` has no length: `{from}` and `{to}` are at the same place; give it two nodes that are apart"
    )]
    ZeroLength {
        /// Member or actuator.
        what: &'static str,
        /// Its name.
        name: String,
        /// First end.
        from: String,
        /// Second end.
        to: String,
    },
    /// Any other error, in words.
    #[error("{0}")]
    Form(String),
}

/// An error in a description, with its line.
#[derive(Debug, Clone, PartialEq)]
pub struct DescriptionError {
    /// The line in the text, counted from 1, if known.
    pub line: Option<usize>,
    /// What is wrong, and what is expected.
    pub problem: DescriptionProblem,
}

impl fmt::Display for DescriptionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(line) = self.line {
            write!(f, "line {line}: ")?;
        }
        // Problems quote the file, whose content is arbitrary.
        f.write_str(&quotation(&self.problem.to_string(), LONGEST_PROBLEM))
    }
}

impl std::error::Error for DescriptionError {}

/// All errors in a description, in the order of lines.
#[derive(Debug, Clone, PartialEq)]
pub struct DescriptionErrors(pub Vec<DescriptionError>);

impl DescriptionErrors {
    /// The errors one by one.
    pub fn iter(&self) -> std::slice::Iter<'_, DescriptionError> {
        self.0.iter()
    }
}

impl fmt::Display for DescriptionErrors {
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

impl std::error::Error for DescriptionErrors {}
