//! A component's history, latest first.

use ratatui::layout::Rect;
use vocabulary::words::{Tone, or_nothing, utc};

use super::cells::{Cells, part};
use crate::model::close_up::Fetched;
use crate::model::history::ComponentHistory;

pub(super) fn draw(journal: &ComponentHistory, area: Rect, cells: &mut Cells) {
    let title =
        format!("HISTORY of {} of {}", journal.subject.component, journal.subject.structure);
    cells.text(area, 0, &title, cells.palette.heading(true));
    if let Some(lacks) = &journal.lacks {
        cells.right(area, 0, &format!(" {lacks} "), cells.palette.tone(Tone::Doubt));
    }
    let body = part(area, 1, area.height);
    let entries = match &journal.entries {
        Fetched::Here(entries) => entries,
        Fetched::Awaited => return cells.text(body, 0, "no answer yet", cells.palette.dim()),
        Fetched::Missing(why) => {
            let tone = cells.palette.tone(Tone::Alarm);
            return cells.text(
                body,
                0,
                &format!("not read: {}", vocabulary::words::printable(why)),
                tone,
            );
        }
    };
    if entries.is_empty() {
        cells.text(body, 0, "no transition is in the journal", cells.palette.dim());
    }
    let shown = entries.iter().skip(journal.place).take(usize::from(body.height));
    for (line, (number, entry)) in (0..).zip(shown) {
        let (number, time) = (format!("{:>5}", or_nothing(*number)), utc(entry.time_unix_ns));
        let columns = [(number.as_str(), 5), (&time, 24), (&entry.what, 14), (&entry.why, 0)];
        cells.row(body, line, &columns, cells.palette.tone(entry.tone));
    }
}
