//! Symbols and colours. A colour always comes with a symbol and a word.

use observer::Urgency;
use ratatui::style::{Color, Modifier, Style};
use vocabulary::words::Tone;

/// The styles of a screen.
#[derive(Debug, Clone, Copy)]
pub(super) struct Palette {
    pub(super) colours: bool,
}

impl Palette {
    #[expect(clippy::unused_self, reason = "called like the other styles")]
    pub(super) fn plain(self) -> Style {
        Style::new()
    }

    pub(super) fn tone(self, tone: Tone) -> Style {
        match tone {
            Tone::Alarm => self.coloured(Color::Red).add_modifier(Modifier::BOLD),
            Tone::Doubt => self.coloured(Color::Yellow),
            Tone::Explained => self.coloured(Color::Cyan),
            Tone::Calm => self.plain(),
        }
    }

    /// Headings; that of the active list is highlighted.
    pub(super) fn heading(self, is_active: bool) -> Style {
        let style = self.plain().add_modifier(Modifier::BOLD);
        if is_active { style.add_modifier(Modifier::REVERSED) } else { style }
    }

    pub(super) fn dim(self) -> Style {
        self.plain().add_modifier(Modifier::DIM)
    }

    fn coloured(self, colour: Color) -> Style {
        if self.colours { self.plain().fg(colour) } else { self.plain() }
    }

    /// The colour of lines and other elements without text.
    pub(super) fn colour(self, colour: Color) -> Color {
        if self.colours { colour } else { Color::Reset }
    }
}

/// The symbol of a component's state.
pub(super) fn symbol(urgency: Urgency) -> &'static str {
    match urgency {
        Urgency::Latched => "▲",
        Urgency::Unreliable => "✖",
        Urgency::Unconfirmed => "?",
        Urgency::Unknown => "◌",
        Urgency::Acknowledged => "△",
        Urgency::SetAside => "‖",
        Urgency::Explained => "→",
        Urgency::Tentative => "~",
        Urgency::Normal => "·",
    }
}

/// The symbol of a module.
pub(super) fn module_symbol(tone: Tone) -> &'static str {
    match tone {
        Tone::Alarm => "✖",
        Tone::Doubt => "◌",
        Tone::Explained | Tone::Calm => "·",
    }
}
