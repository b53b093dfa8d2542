//! Colours for terminals.

use anstream::{AutoStream, ColorChoice};
use anstyle::{AnsiColor, Style};
use vocabulary::words::Tone;

/// A colour or weight of text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Colour {
    Red,
    Green,
    Yellow,
    Cyan,
    Dim,
}

/// The colour of a tone; `None` for a calm one.
pub(crate) fn tone_colour(tone: Tone) -> Option<Colour> {
    match tone {
        Tone::Alarm => Some(Colour::Red),
        Tone::Doubt => Some(Colour::Yellow),
        Tone::Explained => Some(Colour::Green),
        Tone::Calm => None,
    }
}

/// Colours text, or leaves it unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Paint(bool);

impl Paint {
    /// Leaves text unchanged.
    pub(crate) const NONE: Paint = Paint(false);

    /// Colours text if the output is a terminal with colours and `NO_COLOR` is not set (<https://no-color.org>).
    pub(crate) fn of_stdout() -> Paint {
        Paint(AutoStream::choice(&std::io::stdout()) != ColorChoice::Never)
    }

    /// Whether colours are shown.
    pub(crate) fn has_colours(self) -> bool {
        self.0
    }

    pub(crate) fn in_colour(self, colour: Colour, text: &str) -> String {
        let style = match colour {
            Colour::Red => AnsiColor::Red.on_default().bold(),
            Colour::Green => AnsiColor::Green.on_default(),
            Colour::Yellow => AnsiColor::Yellow.on_default(),
            Colour::Cyan => AnsiColor::Cyan.on_default(),
            Colour::Dim => Style::new().dimmed(),
        };
        self.styled(style, text)
    }

    pub(crate) fn bold(self, text: &str) -> String {
        self.styled(Style::new().bold(), text)
    }

    fn styled(self, style: Style, text: &str) -> String {
        if self.0 { format!("{style}{text}{style:#}") } else { text.to_owned() }
    }
}
