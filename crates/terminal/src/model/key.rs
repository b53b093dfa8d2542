//! Keys, independent of the library that reads them.

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

/// Rows per page.
const PAGE: isize = 10;

impl KeyPress {
    /// The number of rows by which the key moves a selection, if it does.
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
