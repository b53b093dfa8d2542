//! The modules: phase, lag, age, journal, shelved and suppressed alarms.

use observer::ModuleView;
use ratatui::layout::Rect;
use vocabulary::words::{NOTHING, Tone, or_nothing};

use super::cells::Cells;
use super::palette::module_symbol;
use crate::model::{Model, Pane};

/// Maximum width of each column; the last takes the remaining width.
const MOST: [u16; 7] = [1, 24, 19, 8, 12, 8, 0];

pub(super) fn draw(model: &Model, area: Rect, cells: &mut Cells) {
    let (modules, is_active) = (&model.shown().modules, model.pane == Pane::Modules);
    let heading = ["", "MODULE", "phase", "lag", "heard", "journal", "remarks"];
    let mut rows = vec![heading.map(str::to_owned)];
    rows.extend(modules.iter().map(|module| texts(module, model.shown_unix_ns())));
    let tones: Vec<Tone> = modules.iter().map(ModuleView::tone).collect();
    let place = model.module_place(&model.modules());
    cells.table(area, (&rows, MOST), &tones, (place, is_active));
    if modules.is_empty() {
        let text = format!("no module answers yet at {}", model.settings.places);
        cells.text(area, 1, &text, cells.palette.tone(Tone::Doubt));
    }
}

fn texts(module: &ModuleView, now_unix_ns: u64) -> [String; 7] {
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
        module.heard(now_unix_ns),
        match problem {
            Some(_) => "PROBLEM".to_owned(),
            None => or_nothing(journal),
        },
        if remarks.is_empty() { NOTHING.to_owned() } else { remarks.join("; ") },
    ]
}
