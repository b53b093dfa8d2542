//! The latest events, the latest at the bottom.

use observer::{Event, News};
use ratatui::layout::Rect;
use wording::{Tone, identified, phase_in_words, phase_tone, printable, reason, state_tone, utc};

use super::cells::{Cells, part};
use crate::model::{Model, Pane};

/// An event in words.
struct Line {
    who: String,
    what: String,
    why: String,
    tone: Tone,
}

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
        let drawn = line_of(event);
        let time = utc(event.time_unix_ns);
        let time = time.get(11..23).unwrap_or(&time);
        let columns = [(time, 12), (&drawn.who, 22), (&drawn.what, 14), (&drawn.why, 0)];
        cells.row(body, line, &columns, cells.palette.tone(drawn.tone));
    }
}

fn line_of(event: &Event) -> Line {
    let line =
        |who: String, what: &str, why: String, tone| Line { who, what: what.to_owned(), why, tone };
    match &event.news {
        News::Fault(change) => line(
            change.component.to_string(),
            change.state().as_str(),
            reason(change),
            state_tone(change.state()),
        ),
        News::Identification(found) => {
            let what = if found.decided { "identified" } else { "not identified" };
            line(found.component.to_string(), what, identified(found), Tone::Calm)
        }
        News::Phase(change) => line(
            change.module.to_string(),
            phase_in_words(change.phase),
            printable(&change.reason),
            phase_tone(change.phase),
        ),
        News::Presence { who, there: true, .. } => {
            line(printable(who), "there", String::new(), Tone::Calm)
        }
        News::Presence { who, .. } => line(printable(who), "GONE", String::new(), Tone::Alarm),
        News::SeveralProcesses { module, .. } => {
            let why = "several processes run as this module: end all but one".to_owned();
            line(module.to_string(), "SEVERAL", why, Tone::Doubt)
        }
        News::Missed { module, from, to, reason, .. } => {
            let why = format!("transitions {from} to {to} could not be had: {}", printable(reason));
            line(module.to_string(), "MISSED", why, Tone::Alarm)
        }
        News::Unreadable { problem, .. } => {
            line(String::new(), "not understood", printable(problem), Tone::Doubt)
        }
        News::Lost(count) => {
            line(String::new(), "LOST", format!("{count} messages: too many at once"), Tone::Alarm)
        }
    }
}
