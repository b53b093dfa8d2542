//! Questions travel as the parameters of a query, `name=value` pairs separated by `&` or `;`. Parameters
//! that are not known are passed over: the network adds some of its own.

use crate::Step;
use crate::quotation;

/// Parameters that make no question.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum QuestionError {
    /// A parameter is missing.
    #[error("`{0}` is missing; ask `KEY?{0}=NUMBER`")]
    Missing(&'static str),
    /// A parameter is not a number.
    #[error("`{name}` is `{value}`; use a whole number of at least 0")]
    NotANumber {
        /// Which.
        name: &'static str,
        /// What it is.
        value: String,
    },
    /// A parameter has a value that is not among the known ones.
    #[error("`{name}` is `{value}`; use {known}")]
    Unknown {
        /// Which.
        name: &'static str,
        /// What it is.
        value: String,
        /// What there is, in words.
        known: String,
    },
    /// A parameter is given twice.
    #[error("`{0}` is given twice")]
    Repeated(&'static str),
    /// The first step comes after the last.
    #[error("the first step {from} is later than the last, {to}; use an earlier step")]
    Backwards {
        /// First step of interest.
        from: Step,
        /// Last step of interest.
        to: Step,
    },
}

/// The text that a parameter gives, if it is there.
fn value<'a>(text: &'a str, name: &'static str) -> Result<Option<&'a str>, QuestionError> {
    let mut values = text
        .split(['&', ';'])
        .filter_map(|pair| pair.split_once('=').or(Some((pair, ""))))
        .filter_map(|(key, value)| (key == name).then_some(value));
    let value = values.next();
    if values.next().is_some() { Err(QuestionError::Repeated(name)) } else { Ok(value) }
}

/// The number that a parameter gives, if it is there.
pub(crate) fn number(text: &str, name: &'static str) -> Result<Option<u64>, QuestionError> {
    let Some(value) = value(text, name)? else { return Ok(None) };
    let parsed = value.parse();
    parsed.map(Some).map_err(|_| QuestionError::NotANumber { name, value: quotation(value, 64) })
}

/// Which of these a parameter gives, if it is there.
pub(crate) fn one_of<T: Copy>(
    text: &str,
    name: &'static str,
    all: &[T],
    as_str: fn(T) -> &'static str,
) -> Result<Option<T>, QuestionError> {
    let Some(value) = value(text, name)? else { return Ok(None) };
    let found = all.iter().copied().find(|one| as_str(*one) == value);
    found.map(Some).ok_or_else(|| {
        let known = all.iter().map(|one| as_str(*one)).collect::<Vec<_>>().join(" or ");
        QuestionError::Unknown { name, value: quotation(value, 64), known }
    })
}

/// The number that a parameter gives.
pub(crate) fn required(text: &str, name: &'static str) -> Result<u64, QuestionError> {
    number(text, name)?.ok_or(QuestionError::Missing(name))
}

pub(crate) fn in_order(from: Step, to: Step) -> Result<(), QuestionError> {
    if from > to { Err(QuestionError::Backwards { from, to }) } else { Ok(()) }
}
