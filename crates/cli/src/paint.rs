//! Colours, on terminals.

use wording::Tone;

/// A colour or weight of text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Colour {
    Red,
    Green,
    Yellow,
    Cyan,
    Dim,
}

/// The colour of what asks for this much attention.
pub(crate) fn tone_colour(tone: Tone) -> Option<Colour> {
    match tone {
        Tone::Alarm => Some(Colour::Red),
        Tone::Doubt => Some(Colour::Yellow),
        Tone::Explained => Some(Colour::Green),
        Tone::Calm => None,
    }
}

/// Paints text, or leaves it alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Paint(bool);

impl Paint {
    /// Paints if the output is a terminal and `NO_COLOR` is not set (<https://no-color.org>).
    pub(crate) fn for_terminal(is_terminal: bool) -> Paint {
        let refused = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
        Paint(is_terminal && !refused)
    }

    /// Whether colours are shown.
    pub(crate) fn has_colours(self) -> bool {
        self.0
    }

    pub(crate) fn in_colour(self, colour: Colour, text: &str) -> String {
        let code = match colour {
            Colour::Red => "1;31",
            Colour::Green => "32",
            Colour::Yellow => "33",
            Colour::Cyan => "36",
            Colour::Dim => "2",
        };
        self.wrap(code, text)
    }

    pub(crate) fn bold(self, text: &str) -> String {
        self.wrap("1", text)
    }

    fn wrap(self, code: &str, text: &str) -> String {
        if self.0 { format!("\x1b[{code}m{text}\x1b[0m") } else { text.to_owned() }
    }
}
