//! What an error quotes of a foreign text.

use crate::printable::printable;

/// The first `longest` characters of a text, what is not printable among them escaped: a hostile text must
/// neither fill a log nor forge further lines of it.
#[must_use]
pub fn quotation(text: &str, longest: usize) -> String {
    let end = text.char_indices().nth(longest).map_or(text.len(), |(end, _)| end);
    printable(&text[..end])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quotation_is_short_and_on_one_line() {
        assert_eq!(quotation("module \"ü\"", 64), "module \"ü\"");
        assert_eq!(quotation("a\nERROR b\u{1b}[2K", 64), "a\\nERROR b\\u{1b}[2K");
        assert_eq!(quotation("a\u{202e}b", 64), "a\\u{202e}b");
        assert_eq!(quotation("abc", 2), "ab");
        assert_eq!(quotation("üü", 2), "üü");
    }
}
