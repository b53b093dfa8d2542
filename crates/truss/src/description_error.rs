//! What can be wrong with a description, each mistake with its line.

use std::fmt;

use vocabulary::{NameError, quotation};

const LONGEST_PROBLEM: usize = 1000;

/// One mistake in a description.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DescriptionProblem {
    /// Invalid TOML, or a key missing, unknown or of the wrong type.
    #[error("{0}")]
    Format(String),
    /// A text that cannot be a name.
    #[error(transparent)]
    Name(#[from] NameError),
    /// A name that nothing bears.
    #[error("{user} refers to {what} `{name}`, which is not described; {hint}")]
    Unknown {
        /// Who refers to it.
        user: String,
        /// What kind of thing is missing.
        what: &'static str,
        /// The name.
        name: String,
        /// What exists.
        hint: String,
    },
    /// Two things with the same name.
    #[error("{what} `{name}` is described twice{first}; give each its own name")]
    Duplicate {
        /// What kind of thing.
        what: &'static str,
        /// The name.
        name: String,
        /// Where the first one stands.
        first: String,
    },
    /// A number outside its range.
    #[error("`{quantity}` of {owner} is {value}; use {expected}")]
    Number {
        /// Which number.
        quantity: &'static str,
        /// Whose number.
        owner: String,
        /// The value.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// Both ends at the same place.
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
    /// Anything else, in words.
    #[error("{0}")]
    Form(String),
}

/// One mistake in a description, with its line.
#[derive(Debug, Clone, PartialEq)]
pub struct DescriptionError {
    /// Line in the text, counted from 1, where it is known.
    pub line: Option<usize>,
    /// What is wrong and what would be right.
    pub problem: DescriptionProblem,
}

impl fmt::Display for DescriptionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(line) = self.line {
            write!(f, "line {line}: ")?;
        }
        // Problems quote what stands in a file, which may be anything.
        f.write_str(&quotation(&self.problem.to_string(), LONGEST_PROBLEM))
    }
}

impl std::error::Error for DescriptionError {}

/// Every mistake in a description, in the order of its lines.
#[derive(Debug, Clone, PartialEq)]
pub struct DescriptionErrors(pub Vec<DescriptionError>);

impl DescriptionErrors {
    /// The mistakes one by one.
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
