//! Foreign texts, made harmless for people to read: on a terminal, in a log, in a status line.

/// Whether a character shows itself, and only itself: it neither controls the terminal, nor changes the order in
/// which others are shown, nor is invisible.
#[must_use]
pub fn is_printable(character: char) -> bool {
    !character.is_control()
        && !matches!(
            character,
            '\u{61c}'                     // mark of direction
            | '\u{200b}'..='\u{200f}'     // without width, marks of direction
            | '\u{2028}'..='\u{202e}'     // ends of lines and paragraphs, embeddings and overrides of direction
            | '\u{2060}'..='\u{206f}'     // without width, isolates of direction
            | '\u{feff}'                  // byte order mark
            | '\u{fff9}'..='\u{fffb}'     // annotations
            | '\u{e0000}'..='\u{e007f}'   // tags
        )
}

/// The text on one line, whatever is not printable escaped: `\n`, `\u{202e}`.
#[must_use]
pub fn printable(text: &str) -> String {
    let mut printable = String::with_capacity(text.len());
    for character in text.chars() {
        if is_printable(character) {
            printable.push(character);
        } else {
            printable.extend(character.escape_default());
        }
    }
    printable
}

/// The same for a text that may have several lines.
#[must_use]
pub fn printable_lines(text: &str) -> String {
    text.split('\n').map(printable).collect::<Vec<_>>().join("\n")
}

/// A character as a terminal without UTF-8 can show it, one column wide like the original: a similar one, or `?`.
#[must_use]
pub fn in_ascii(character: char) -> char {
    match character {
        '\0'..='\u{7f}' => character,
        'µ' | 'μ' => 'u',
        'ε' => 'e',
        'γ' => 'g',
        'σ' => 's',
        '²' => '2',
        '³' => '3',
        '×' => 'x',
        '·' | '…' | '╌' => '.',
        '−' | '–' | '—' | '─' => '-',
        '│' | '┊' | '┆' | '‖' => '|',
        '┌' | '┐' | '└' | '┘' | '├' | '┤' | '┬' | '┴' | '┼' => '+',
        '→' | '≥' => '>',
        '←' | '≤' => '<',
        '↑' | '△' => '^',
        '↓' => 'v',
        '▲' => '!',
        '✖' => 'X',
        '◌' | '°' => 'o',
        '•' => '*',
        // Dots of a plot.
        '\u{2800}' => ' ',
        '\u{2801}'..='\u{28ff}' => '*',
        '‘' | '’' => '\'',
        '“' | '”' => '"',
        _ => '?',
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// What Unicode calls control characters, and its characters of direction and format.
    fn is_forbidden(character: char) -> bool {
        matches!(u32::from(character),
            0..=0x1f | 0x7f..=0x9f | 0x200b..=0x200f | 0x202a..=0x202e | 0x2066..=0x2069 | 0xfeff)
    }

    /// Texts in which such characters are frequent.
    fn texts() -> impl Strategy<Value = String> {
        let odd = proptest::sample::select(vec![
            '\n', '\r', '\t', '\u{1b}', '\u{7f}', '\u{9b}', '\u{200e}', '\u{202e}', '\u{2066}',
            '\u{feff}',
        ]);
        let characters = prop_oneof![any::<char>(), odd, proptest::char::range(' ', '~')];
        proptest::collection::vec(characters, 0..40).prop_map(|text| text.into_iter().collect())
    }

    proptest! {
        #[test]
        fn nothing_is_left_that_does_more_than_show_itself(text in texts()) {
            prop_assert!(!printable(&text).chars().any(is_forbidden));
            let lines = printable_lines(&text);
            prop_assert!(!lines.chars().any(|c| c != '\n' && is_forbidden(c)));
            prop_assert_eq!(lines.matches('\n').count(), text.matches('\n').count());
        }

        #[test]
        fn what_is_printable_stays_as_it_is(text in texts()) {
            let kept: String = text.chars().filter(|c| is_printable(*c)).collect();
            prop_assert_eq!(printable(&kept), kept);
            let once = printable(&text);
            prop_assert_eq!(printable(&once), once);
        }
    }

    #[test]
    fn letters_signs_and_accents_of_every_script_are_printable() {
        let text = "grün µm ≥ 3 × ∅ — 塔 مرحبا שלום e\u{301}";
        assert_eq!(printable(text), text);
    }

    #[test]
    fn a_terminal_without_utf_8_gets_as_many_characters_that_it_can_show() {
        let shown = |text: &str| text.chars().map(in_ascii).collect::<String>();
        assert_eq!(shown("─ 45 µm → ≥ 3 × γ …"), "- 45 um > > 3 x g .");
        assert_eq!(shown("▲△✖◌‖·⣿ Müller"), "!^Xo|.* M?ller");
    }

    #[test]
    fn what_is_not_printable_is_seen() {
        assert_eq!(
            printable("a\nb\u{1b}[2J \u{9b} \u{202e}c"),
            "a\\nb\\u{1b}[2J \\u{9b} \\u{202e}c"
        );
        assert_eq!(printable_lines("a\r\nb"), "a\\r\nb");
    }
}
