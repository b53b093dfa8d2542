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
        let time = time(drawn.time_unix_ns, model.shown_unix_ns());
        let columns = [(&*time, 12), (&drawn.who, 22), (&drawn.what, 14), (&drawn.why, 0)];
        cells.row(body, line, &columns, cells.palette.tone(drawn.tone));
    }
}

/// The time of day, or of another day the date and the minute.
fn time(time_unix_ns: u64, now_unix_ns: u64) -> String {
    let [time, now] = [time_unix_ns, now_unix_ns].map(utc);
    let (date, of_day) = time.split_at(11);
    if now.starts_with(date) { of_day[..12].to_owned() } else { time[5..16].replace('T', " ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_on_another_day_is_not_shown_as_of_today() {
        const HOUR: u64 = 3_600_000_000_000;
        assert_eq!(time(25 * HOUR, 26 * HOUR), "01:00:00.000");
        assert_eq!(time(23 * HOUR, 26 * HOUR), "01-01 23:00");
        assert_eq!(time(25 * HOUR, 23 * HOUR), "01-02 01:00");
    }
}
