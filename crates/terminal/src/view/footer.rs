//! The outcome of the latest key, or else the reason for the selected row's state; and the available keys.

use ratatui::layout::Rect;

use super::cells::Cells;
use super::fault_table;
use crate::model::Model;

pub(super) fn draw(model: &Model, area: Rect, cells: &mut Cells) {
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
