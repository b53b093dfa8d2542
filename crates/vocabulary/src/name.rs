//! Names as types. They stand in configuration files, in key expressions and in messages, so one alphabet serves
//! all three: ASCII letters, digits, `_` and `-`, at most [`MAX_NAME_LENGTH`] characters.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::quotation::quotation;

/// Longest name that is accepted, in characters.
pub const MAX_NAME_LENGTH: usize = 64;

/// What the schema of a message says of names; [`check_name`] says the same.
const PATTERN: &str = "^[A-Za-z0-9_][A-Za-z0-9_-]{0,63}$";

/// A text that cannot serve as a name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{text}` is not a usable {what}: use 1 to {MAX_NAME_LENGTH} letters, digits, `_` or `-`, not starting with `-`"
)]
pub struct NameError {
    what: &'static str,
    text: String,
}

fn check_name(what: &'static str, text: &str) -> Result<(), NameError> {
    let allowed = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    let usable = !text.is_empty()
        && text.len() <= MAX_NAME_LENGTH
        && !text.starts_with('-')
        && text.chars().all(allowed);
    if usable {
        Ok(())
    } else {
        Err(NameError { what, text: quotation(text, MAX_NAME_LENGTH + 1) })
    }
}

macro_rules! name_type {
    ($(#[$doc:meta])* $name:ident, $what:literal) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[serde(try_from = "String", into = "String")]
        #[derive(schemars::JsonSchema)]
        #[schemars(extend("pattern" = PATTERN))]
        pub struct $name(String);

        impl $name {
            /// Checks the text and wraps it.
            ///
            /// # Errors
            /// A text outside the alphabet of names.
            pub fn new(text: impl Into<String>) -> Result<Self, NameError> {
                let text = text.into();
                check_name($what, &text)?;
                Ok(Self(text))
            }

            /// The bare text.
            #[must_use]
            pub fn as_str(&self) -> &str {
                &self.0
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(&self.0)
            }
        }

        impl FromStr for $name {
            type Err = NameError;
            fn from_str(text: &str) -> Result<Self, NameError> {
                Self::new(text)
            }
        }

        impl TryFrom<String> for $name {
            type Error = NameError;
            fn try_from(text: String) -> Result<Self, NameError> {
                Self::new(text)
            }
        }

        impl From<$name> for String {
            fn from(name: $name) -> String {
                name.0
            }
        }
    };
}

name_type!(
    /// Name of a whole structure, e.g. `tower`.
    StructureName,
    "structure name"
);
name_type!(
    /// Name of a module, e.g. `module1`.
    ModuleName,
    "module name"
);
name_type!(
    /// Name of an operator, as in a certificate, e.g. `ada`.
    OperatorName,
    "operator's name"
);
name_type!(
    /// Name of an actuator, unique in its module, e.g. `a3`.
    ActuatorName,
    "actuator name"
);
name_type!(
    /// Name of a strain gage, unique in its module, e.g. `g5`.
    GageName,
    "gage name"
);
name_type!(
    /// Name of a node, unique in its structure, e.g. `L03C2`.
    NodeName,
    "node name"
);
name_type!(
    /// Name of a member, unique in its structure.
    MemberName,
    "member name"
);
name_type!(
    /// Name of a cross-section, unique in its structure.
    SectionName,
    "section name"
);
name_type!(
    /// Name of a material, unique in its structure.
    MaterialName,
    "material name"
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_outside_the_alphabet_are_refused_and_named() {
        for bad in ["", "a/b", "a*", "-x", "ü", "a b", &"n".repeat(65)] {
            let error = ModuleName::new(bad).unwrap_err().to_string();
            assert!(error.contains("module name"), "{error}");
        }
        let forged = ModuleName::new("m\nERROR all is lost").unwrap_err().to_string();
        assert!(!forged.contains('\n'), "{forged}");
        assert_eq!(ModuleName::new("module_1-b").unwrap().as_str(), "module_1-b");
    }
}
