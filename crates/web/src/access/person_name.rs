//! The name of a user who signs in; modules record it in their journal with every order.

use vocabulary::{is_printable, quotation};

/// Longest name, in bytes.
const LONGEST: usize = 100;

/// A printable text on one line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PersonName(String);

/// An invalid name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is not usable as a person's name: use 1 to {LONGEST} bytes of printable text without spaces at its ends"
)]
pub struct PersonNameError(String);

impl PersonName {
    /// The name as text.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl std::str::FromStr for PersonName {
    type Err = PersonNameError;

    fn from_str(text: &str) -> Result<Self, PersonNameError> {
        let is_usable = !text.is_empty()
            && text.len() <= LONGEST
            && text.trim() == text
            && text.chars().all(is_printable);
        if is_usable {
            Ok(Self(text.to_owned()))
        } else {
            Err(PersonNameError(quotation(text, LONGEST)))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_people_are_printable_and_short() {
        for usable in ["ada", "Ada Lovelace", "Ørsted, H. C.", "塔", &"a".repeat(100)] {
            assert_eq!(usable.parse::<PersonName>().unwrap().as_str(), usable);
        }
        for unusable in
            ["", " ada", "ada ", "a\nb", "a\r\nSet-Cookie: x", "a\u{202e}b", &"a".repeat(101)]
        {
            let error = unusable.parse::<PersonName>().unwrap_err().to_string();
            assert!(error.contains("is not usable as a person's name"), "{error}");
            assert!(!error.contains('\n'), "{error}");
        }
    }
}
