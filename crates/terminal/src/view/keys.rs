//! Which keys there are: the footer and the help screen.

use ratatui::layout::Rect;

use super::cells::Cells;
use super::fault_table;
use crate::model::Model;

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
  ▲ latched: a fault not yet acknowledged                △ acknowledged
  ✖ module silent, stale or not answering                ? unconfirmed
  ◌ not known whether it is healthy                      ‖ shelved or suppressed
  → explained by another component                       ~ changed a moment ago
  · normal, or module in service";

/// The help screen.
pub(super) fn help(area: Rect, cells: &mut Cells) {
    for (line, text) in (0..).zip(HELP.lines()) {
        cells.text(area, line, text, cells.palette.plain());
    }
}

/// The outcome of the latest key, or else the reason for the selected row's state; and the available keys.
pub(super) fn footer(model: &Model, area: Rect, cells: &mut Cells) {
    let is_covered = model.helps || model.journal.is_some() || model.close_up.is_some();
    if let Some(notice) = &model.notice {
        cells.text(area, 0, &notice.text, cells.palette.tone(notice.tone));
    } else if let Some(detail) = fault_table::selected(model).filter(|_| !is_covered) {
        cells.text(area, 0, &detail, cells.palette.plain());
    }
    cells.text(area, 1, keys(model), cells.palette.dim());
}

fn keys(model: &Model) -> &'static str {
    if model.types_filter {
        "type words · Enter keeps the filter · Esc ends it"
    } else if model.helps {
        "any key closes the help"
    } else if model.journal.is_some() {
        "↑↓ scroll · Esc back · a acknowledge · r reset · s shelve · f freeze · q quit"
    } else if model.close_up.is_some() {
        "Esc back · a acknowledge · r reset · s shelve · u unshelve · h history · q quit"
    } else {
        "? help · ↑↓ Tab Enter · / filter · f freeze · a ack · r reset · s shelve · h · q"
    }
}
