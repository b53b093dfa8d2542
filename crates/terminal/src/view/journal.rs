//! A component's history, the latest first.

use ratatui::layout::Rect;
use wording::{Tone, reason, state_tone, utc};

use super::cells::{Cells, part};
use crate::model::close_up::Had;
use crate::model::journal::Journal;

pub(super) fn draw(journal: &Journal, area: Rect, cells: &mut Cells) {
    let title =
        format!("HISTORY of {} of {}", journal.subject.component, journal.subject.structure);
    cells.text(area, 0, &title, cells.palette.heading(true));
    if let Some(lacks) = &journal.lacks {
        cells.right(area, 0, &format!(" {lacks} "), cells.palette.tone(Tone::Doubt));
    }
    let body = part(area, 1, area.height);
    let transitions = match &journal.transitions {
        Had::Here(transitions) => transitions,
        Had::Awaited => return cells.text(body, 0, "no answer yet", cells.palette.dim()),
        Had::Missing(why) => {
            return cells.text(
                body,
                0,
                &format!("not to be had: {}", wording::printable(why)),
                cells.palette.tone(Tone::Alarm),
            );
        }
    };
    if transitions.is_empty() {
        cells.text(body, 0, "no transition is in the journal", cells.palette.dim());
    }
    let shown = transitions.iter().skip(journal.place).take(usize::from(body.height));
    for (line, change) in (0..).zip(shown) {
        let (number, time) = (format!("{:>5}", change.sequence), utc(change.time_unix_ns));
        let why = reason(change);
        let columns = [(number.as_str(), 5), (&time, 24), (change.state().as_str(), 12), (&why, 0)];
        cells.row(body, line, &columns, cells.palette.tone(state_tone(change.state())));
    }
}
