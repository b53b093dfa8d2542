//! Keys, whatever reads them.

/// A key that was pressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Key {
    Char(char),
    /// With the control key.
    Control(char),
    Up,
    Down,
    PageUp,
    PageDown,
    Home,
    End,
    Enter,
    Esc,
    Tab,
    BackTab,
    Backspace,
}

/// Rows of a page.
const PAGE: isize = 10;

impl Key {
    /// By how many rows it moves a selection, if that is what it does.
    pub(crate) fn step(self) -> Option<isize> {
        match self {
            Key::Up | Key::Char('k') => Some(-1),
            Key::Down | Key::Char('j') => Some(1),
            Key::PageUp => Some(-PAGE),
            Key::PageDown => Some(PAGE),
            Key::Home | Key::Char('g') => Some(isize::MIN),
            Key::End | Key::Char('G') => Some(isize::MAX),
            _ => None,
        }
    }
}
