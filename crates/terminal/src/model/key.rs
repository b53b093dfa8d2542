//! Keys, whatever reads them.

/// A key that was pressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum KeyPress {
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

impl KeyPress {
    /// By how many rows it moves a selection, if that is what it does.
    pub(crate) fn step(self) -> Option<isize> {
        match self {
            KeyPress::Up | KeyPress::Char('k') => Some(-1),
            KeyPress::Down | KeyPress::Char('j') => Some(1),
            KeyPress::PageUp => Some(-PAGE),
            KeyPress::PageDown => Some(PAGE),
            KeyPress::Home | KeyPress::Char('g') => Some(isize::MIN),
            KeyPress::End | KeyPress::Char('G') => Some(isize::MAX),
            _ => None,
        }
    }
}
