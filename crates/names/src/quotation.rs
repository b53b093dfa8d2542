//! What an error quotes of a foreign text.

/// The first `longest` characters of a text, control characters escaped: a hostile text must neither fill
/// a log nor forge further lines of it.
#[must_use]
pub fn quotation(text: &str, longest: usize) -> String {
    let mut quoted = String::new();
    for character in text.chars().take(longest) {
        if character.is_control() {
            quoted.extend(character.escape_default());
        } else {
            quoted.push(character);
        }
    }
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quotation_is_short_and_on_one_line() {
        assert_eq!(quotation("module \"ü\"", 64), "module \"ü\"");
        assert_eq!(quotation("a\nERROR b\u{1b}[2K", 64), "a\\nERROR b\\u{1b}[2K");
        assert_eq!(quotation("abc", 2), "ab");
    }
}
