//! Collects errors in a set of parameters, so that all are reported at once.

use std::fmt;
use std::ops::RangeInclusive;

/// A parameter outside its range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("`{parameter}` is {value}; use {expected}")]
pub struct ParameterError {
    /// Path of the parameter as in a configuration file, e.g. `hydraulics.supply_pa`.
    pub parameter: String,
    /// Its value.
    pub value: String,
    /// What is expected.
    pub expected: String,
}

/// All parameters outside their ranges; at least one.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterErrors(pub Vec<ParameterError>);

impl std::error::Error for ParameterErrors {}

impl fmt::Display for ParameterErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, error) in self.0.iter().enumerate() {
            if index > 0 {
                f.write_str("\n")?;
            }
            error.fmt(f)?;
        }
        Ok(())
    }
}

/// Collects errors while a group of parameters is checked.
#[derive(Debug, Default)]
pub(crate) struct Checks {
    errors: Vec<ParameterError>,
}

impl Checks {
    /// Records an error unless `holds`.
    pub(crate) fn require(
        &mut self,
        parameter: &str,
        holds: bool,
        value: impl fmt::Display,
        expected: &str,
    ) {
        if !holds {
            self.errors.push(ParameterError {
                parameter: parameter.to_owned(),
                value: value.to_string(),
                expected: expected.to_owned(),
            });
        }
    }

    /// Records an error unless the value is within the physically plausible range.
    pub(crate) fn within(
        &mut self,
        parameter: &str,
        value: f64,
        range: RangeInclusive<f64>,
        unit: &str,
    ) {
        let [least, largest] = [range.start(), range.end()].map(|end| format!("{end:e}"));
        let ends = [&least, &largest].map(|end| end.trim_end_matches("e0"));
        let expected = format!("{} to {} {unit}", ends[0], ends[1]);
        let value_text = format!("{value:?}");
        self.require(parameter, range.contains(&value), value_text, expected.trim_end());
    }

    pub(crate) fn finish(self) -> Result<(), ParameterErrors> {
        if self.errors.is_empty() { Ok(()) } else { Err(ParameterErrors(self.errors)) }
    }
}
