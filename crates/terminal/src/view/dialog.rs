//! The dialog for an order, drawn over the screen behind it.

use ratatui::layout::Rect;
use ratatui::widgets::{Block, Clear, Widget};
use vocabulary::words::{Tone, printable};

use super::cells::{Cells, folded};
use crate::model::dialog::{Dialog, Stage};

/// Lines inside the frame.
const LINES: u16 = 6;

pub(super) fn draw(dialog: &Dialog, area: Rect, cells: &mut Cells) {
    let height = (LINES + 2).min(area.height);
    let place = Rect { y: area.y + area.height - height, height, ..area };
    let title = format!(
        " {} {} of {} ",
        dialog.kind.as_str(),
        dialog.subject.component,
        dialog.subject.structure
    );
    let block = Block::bordered().title(title);
    let inside = block.inner(place);
    Clear.render(place, cells.buffer);
    block.render(place, cells.buffer);
    let mut lines = Vec::new();
    if dialog.kind.sets_aside() {
        lines.push(typed("for   ", &dialog.span, dialog.stage == Stage::Span));
        lines.push(typed("reason", &dialog.note, dialog.stage == Stage::Note));
    } else {
        lines.push(typed("note  ", &dialog.note, dialog.stage == Stage::Note));
    }
    if dialog.stage == Stage::Confirm {
        let words = format!("SEND: {}?", dialog.words());
        lines.extend(folded(&words, inside.width, 2));
    }
    for (line, text) in (0..).zip(&lines) {
        cells.text(inside, line, text, cells.palette.plain());
    }
    let last = inside.height.saturating_sub(1);
    if let Some(problem) = &dialog.problem {
        let style = cells.palette.tone(Tone::Alarm);
        cells.text(inside, last.saturating_sub(1), &printable(problem), style);
    }
    let enter = if dialog.stage == Stage::Confirm { "Enter sends it" } else { "Enter goes on" };
    let keys = format!("{enter} · ↑ goes back · Esc sends nothing");
    cells.text(inside, last, &keys, cells.palette.dim());
}

fn typed(name: &str, text: &str, is_typed: bool) -> String {
    let end = if is_typed { "_" } else { "" };
    format!("{name}  {}{end}", printable(text))
}
