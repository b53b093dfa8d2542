//! Recent events, the latest at the bottom.

use observer::EventLine;
use ratatui::layout::Rect;
use vocabulary::words::utc;

use super::cells::{Cells, part};
use crate::model::{Model, Pane};

pub(super) fn draw(model: &Model, area: Rect, cells: &mut Cells) {
    let heading = [("EVENTS", 12), ("of", 22), ("what", 14), ("why", 0)];
    cells.row(area, 0, &heading, cells.palette.heading(model.pane == Pane::Events));
    let body = part(area, 1, area.height);
    let mut lines = usize::from(body.height);
    let events = &model.shown().events;
    if model.events_back > 0 && lines > 1 {
        lines -= 1;
        let text = format!("… {} later events below", model.events_back);
        cells.text(body, body.height - 1, &text, cells.palette.dim());
    }
    let latest = events.iter().rev().skip(model.events_back).take(lines);
    let latest: Vec<_> = latest.collect();
    for (line, event) in (0..).zip(latest.iter().rev()) {
        let drawn = EventLine::of(event);
        let time = utc(drawn.time_unix_ns);
        let time = time.get(11..23).unwrap_or(&time);
        let columns = [(time, 12), (&drawn.who, 22), (&drawn.what, 14), (&drawn.why, 0)];
        cells.row(body, line, &columns, cells.palette.tone(drawn.tone));
    }
}
