//! The modules: phase, lag, age, journal, shelved and suppressed alarms.

use observer::ModuleView;
use ratatui::layout::Rect;
use ratatui::style::{Modifier, Style};
use vocabulary::words::{NOTHING, Tone, or_nothing};

use super::age::age;
use super::cells::{Cells, part, widths};
use super::palette::module_symbol;
use crate::model::{Model, Pane};

/// Maximum width of each column; the last takes the remaining width.
const MOST: [u16; 7] = [1, 24, 19, 8, 12, 8, 0];

pub(super) fn draw(model: &Model, area: Rect, cells: &mut Cells) {
    let (modules, is_active) = (model.modules(), model.pane == Pane::Modules);
    let heading = ["", "MODULE", "phase", "lag", "heard", "journal", "remarks"];
    let mut rows = vec![heading.map(str::to_owned)];
    let (scene, now_unix_ns) = (model.shown(), model.shown_unix_ns());
    let seen: Vec<&ModuleView> = modules.iter().filter_map(|whose| scene.view_of(whose)).collect();
    rows.extend(seen.iter().map(|module| texts(module, now_unix_ns)));
    let widths = widths(&rows, MOST);
    put(area, 0, &rows[0], (widths, cells.palette.heading(is_active)), cells);
    let body = part(area, 1, area.height);
    if modules.is_empty() {
        let text = format!("no module answers yet at {}", model.settings.places);
        cells.text(body, 0, &text, cells.palette.tone(Tone::Doubt));
    }
    let place = model.module_place(&modules);
    let lines = usize::from(body.height);
    let first = (place + 1).saturating_sub(lines);
    let shown = seen.iter().zip(&rows[1..]).enumerate().skip(first).take(lines);
    for (line, (number, (module, texts))) in (0..).zip(shown) {
        let mut style = cells.palette.tone(module.tone());
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

fn texts(module: &ModuleView, now_unix_ns: u64) -> [String; 7] {
    let heard = match (module.is_silent, module.heard_unix_ns) {
        (_, 0) => "never".to_owned(),
        (true, since) => format!("{} ago", age(since, now_unix_ns)),
        (false, _) => "now".to_owned(),
    };
    let journal = module.journal();
    let problem = journal.as_ref().filter(|journal| !journal.is_ok());
    let mut remarks = vec![module.remarks()];
    remarks.extend(problem.map(|problem| format!("journal: {problem}")));
    remarks.retain(|remark| !remark.is_empty());
    [
        module_symbol(module.tone()).to_owned(),
        module.module.to_string(),
        module.condition().to_owned(),
        or_nothing(module.lag()),
        heard,
        match problem {
            Some(_) => "PROBLEM".to_owned(),
            None => or_nothing(journal),
        },
        if remarks.is_empty() { NOTHING.to_owned() } else { remarks.join("; ") },
    ]
}
