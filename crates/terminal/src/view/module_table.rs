//! The modules: phase, lag, age, journal, what is set aside.

use observer::LiveModule;
use ratatui::layout::Rect;
use ratatui::style::{Modifier, Style};
use wire::{JournalStatus, ModuleStatus};
use wording::{NOTHING, Tone, or_nothing, printable, span, until};

use super::age::age;
use super::cells::{Cells, part, widths};
use super::palette::module_symbol;
use crate::model::{Model, Pane, Standing};

/// No column is wider than this; the last takes what is left.
const MOST: [u16; 7] = [1, 24, 19, 8, 12, 8, 0];

pub(super) fn draw(model: &Model, area: Rect, cells: &mut Cells) {
    let (modules, is_active) = (model.modules(), model.pane == Pane::Modules);
    let heading = ["", "MODULE", "phase", "lag", "heard", "journal", "remarks"];
    let mut rows = vec![heading.map(str::to_owned)];
    let (scene, now_unix_ns) = (model.shown(), model.shown_unix_ns());
    let seen: Vec<&LiveModule> = modules.iter().filter_map(|whose| whose.find(scene)).collect();
    rows.extend(seen.iter().map(|module| texts(module, now_unix_ns)));
    let widths = widths(&rows, MOST);
    put(area, 0, &rows[0], (widths, cells.palette.heading(is_active)), cells);
    let body = part(area, 1, area.height);
    if modules.is_empty() {
        let text = format!("no module answers yet; looking at {}", model.settings.places);
        cells.text(body, 0, &text, cells.palette.tone(Tone::Doubt));
    }
    let place = model.module_place(&modules);
    let lines = usize::from(body.height);
    let first = (place + 1).saturating_sub(lines);
    let shown = seen.iter().zip(&rows[1..]).enumerate().skip(first).take(lines);
    for (line, (number, (module, texts))) in (0..).zip(shown) {
        let mut style = cells.palette.tone(Standing::of(module).tone());
        if is_active && number == place {
            style = style.add_modifier(Modifier::REVERSED);
        }
        put(body, line, texts, (widths, style), cells);
    }
}

fn put(
    area: Rect,
    line: u16,
    texts: &[String; 7],
    (widths, style): ([u16; 7], Style),
    cells: &mut Cells,
) {
    let columns: Vec<(&str, u16)> = texts.iter().map(String::as_str).zip(widths).collect();
    cells.row(area, line, &columns, style);
}

/// Of a module that is silent, what it said last is not said again.
fn texts(module: &LiveModule, now_unix_ns: u64) -> [String; 7] {
    let standing = Standing::of(module);
    let is_silent = matches!(standing, Standing::Silent(_));
    let status = module.picture.member.status.as_ref().filter(|_| !is_silent);
    let timed = status.filter(|status| status.clock_difference().is_none());
    let heard = match standing {
        Standing::Silent(0) => "never".to_owned(),
        Standing::Silent(since) => format!("{} ago", age(since, now_unix_ns)),
        _ => "now".to_owned(),
    };
    [
        module_symbol(standing.tone()).to_owned(),
        module.picture.member.module.to_string(),
        standing.words().to_owned(),
        or_nothing(timed.and_then(|status| status.lag_ms).map(span)),
        heard,
        or_nothing(status.map(|status| journal(&status.journal))),
        remarks(module, status),
    ]
}

fn journal(journal: &JournalStatus) -> String {
    if journal.problem.is_some() || journal.lost > 0 || journal.unsaved > 0 {
        "PROBLEM".to_owned()
    } else if journal.directory.is_some() {
        "ok".to_owned()
    } else {
        "none".to_owned()
    }
}

fn remarks(module: &LiveModule, status: Option<&ModuleStatus>) -> String {
    let mut remarks = Vec::new();
    if module.picture.has_several_processes() {
        remarks.push("several processes: end all but one".to_owned());
    }
    if let Some(status) = status {
        remarks.extend(status.suppressed.as_ref().map(|by| format!("suppressed {}", until(by))));
        if status.suppressed.is_none() && status.shelved > 0 {
            remarks.push(format!("{} shelved", status.shelved));
        }
        remarks.extend(status.journal.problem.as_ref().map(|why| printable(why)));
        remarks.extend(status.clock_difference().map(|difference| difference.to_string()));
    }
    if remarks.is_empty() { NOTHING.to_owned() } else { remarks.join("; ") }
}
