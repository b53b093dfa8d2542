//! Draws the model into a buffer of cells.
//!
//! | file | what |
//! |---|---|
//! | `header` | structure, counts, network |
//! | `module_table`, `fault_table`, `event_tail` | the main screen |
//! | `close_up` | one component with its plots |
//! | `history` | its history |
//! | `dialog` | the dialog for an order |
//! | `keys` | the footer with the available keys, and the help screen |
//! | `plot` | one curve with a level and marks |
//! | `palette` | symbols and colours |
//! | `cells` | places text in cells |

mod cells;
mod close_up;
mod dialog;
mod event_tail;
mod fault_table;
mod header;
mod history;
mod keys;
mod module_table;
mod palette;
mod plot;

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use vocabulary::in_ascii;

use crate::model::Model;
use cells::{Cells, part};
use palette::Palette;
pub use plot::Plot;

/// Lines of header and footer.
const HEADER: u16 = 2;
const FOOTER: u16 = 2;
/// Smaller screens show only what fits.
const LEAST: (u16, u16) = (40, 10);

/// Draws the whole screen.
pub(crate) fn draw(model: &Model, area: Rect, buffer: &mut Buffer) {
    draw_in_utf8(model, area, buffer);
    if model.settings.ascii {
        // A symbol may have several characters, such as a letter and its accent.
        for cell in &mut buffer.content {
            let shown = cell.symbol().chars().next().map_or(' ', in_ascii);
            cell.set_char(shown);
        }
    }
}

fn draw_in_utf8(model: &Model, area: Rect, buffer: &mut Buffer) {
    let palette = Palette { colours: model.settings.colours };
    let mut cells = Cells { buffer, palette };
    if area.width < LEAST.0 || area.height < LEAST.1 {
        cells.text(area, 0, "too small: 40×10 at least", palette.plain());
        return;
    }
    header::draw(model, part(area, 0, HEADER), &mut cells);
    let body = part(area, HEADER, area.height - HEADER - FOOTER);
    if model.helps {
        keys::help(body, &mut cells);
    } else if let Some(journal) = &model.journal {
        history::draw(journal, body, &mut cells);
    } else if let Some(seen) = &model.close_up {
        close_up::draw(model, seen, body, &mut cells);
    } else {
        lists(model, body, &mut cells);
    }
    keys::footer(model, part(area, area.height - FOOTER, FOOTER), &mut cells);
    if let Some(dialog) = &model.dialog {
        dialog::draw(dialog, area, &mut cells);
    }
}

/// At most a quarter for the modules, at least a quarter for the events, the rest for alarms.
fn lists(model: &Model, area: Rect, cells: &mut Cells) {
    let modules = u16::try_from(model.modules().len()).unwrap_or(u16::MAX);
    let above = 1 + modules.clamp(1, area.height / 4);
    let below = 1 + (area.height / 4).max(4);
    let middle = area.height.saturating_sub(above + below);
    module_table::draw(model, part(area, 0, above), cells);
    fault_table::draw(model, part(area, above, middle), cells);
    event_tail::draw(model, part(area, above + middle, below), cells);
}
