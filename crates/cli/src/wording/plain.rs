//! Texts from the network, made harmless for a terminal.

/// The text on one line, without control characters: they could move the cursor or change colours.
pub(crate) fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_left_that_a_terminal_would_obey() {
        assert_eq!(plain("a\nb\x1b[2Jµ\u{9b}"), "a b [2Jµ ");
    }
}
