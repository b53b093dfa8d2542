//! Keys and symbols.

use ratatui::layout::Rect;

use super::cells::Cells;

const HELP: &str = "\
KEYS
  ↑ ↓ j k      one row; PgUp PgDn ten; g G to the ends   Tab  next list
  Enter        a component: state, reasons, kind, plots; a module: all of it
  Esc          back; then ends the filter
  /            filter by component, module, state or any words of the row
  f, space     freeze the screen, and thaw it            ?    this help
  a  r  s  u   acknowledge, reset, shelve, unshelve what is selected: asks for
               a note and shows what is to be sent before it is sent
  h            history of what is selected               q    quit
  Ctrl-Z       suspend (fg continues)                    Ctrl-U clears a line

SYMBOLS
  ▲ latched: a fault that nobody has acknowledged        △ acknowledged
  ✖ module silent, stale or not answering                ? unconfirmed
  ◌ not known whether it is healthy                      ‖ set aside for a time
  → explained by another component                       ~ changed a moment ago
  · normal, or module in service";

pub(super) fn draw(area: Rect, cells: &mut Cells) {
    for (line, text) in (0..).zip(HELP.lines()) {
        cells.text(area, line, text, cells.palette.plain());
    }
}
