//! Alarms, most urgent first: state, time, kind, reason.

use observer::{RowId, StateRow, attention};
use ratatui::layout::Rect;
use vocabulary::words::{Tone, age, printable};

use super::cells::Cells;
use super::palette::{module_symbol, symbol};
use crate::model::{Model, Pane};

/// From this width on, kind and reason have separate columns.
const WIDE: u16 = 110;

/// Maximum width of each column; the last takes the remaining width.
const MOST: [u16; 6] = [1, 36, 28, 7, 44, 0];

pub(super) fn draw(model: &Model, area: Rect, cells: &mut Cells) {
    let (rows, is_active) = (model.listed(), model.pane == Pane::Faults);
    let mut texts = vec![heading(model, &rows)];
    texts.extend(rows.iter().map(|row| cells_of(row, model.shown_unix_ns())));
    if area.width < WIDE {
        texts.iter_mut().for_each(merge);
    }
    let tones: Vec<Tone> = rows.iter().map(|row| row.tone).collect();
    let keys: Vec<RowId> = rows.iter().map(StateRow::id).collect();
    cells.table(area, (&texts, MOST), &tones, (model.fault_place(&keys), is_active));
    filter(model, area, cells);
    if rows.is_empty() {
        cells.text(area, 1, &empty(model), cells.palette.dim());
    }
}

/// Kind and reason of the selected row.
pub(super) fn selected(model: &Model) -> Option<String> {
    let rows = model.listed();
    let keys: Vec<RowId> = rows.iter().map(StateRow::id).collect();
    let row = rows.get(model.fault_place(&keys)).filter(|_| model.pane == Pane::Faults)?;
    let mut cells = cells_of(row, model.shown_unix_ns());
    merge(&mut cells);
    Some(format!("{}: {}", cells[1], cells[5])).filter(|_| !cells[5].is_empty())
}

/// Those that need attention are counted; shelved, explained and tentative ones beside them.
fn heading(model: &Model, rows: &[StateRow]) -> [String; 6] {
    let count = attention(rows);
    let what = match (&model.scope, rows.len() - count) {
        (Some(scope), _) => format!("ALL OF {} ({})", scope.module, rows.len()),
        (None, 0) => format!("ALARMS ({count})"),
        (None, others) => format!("ALARMS ({count}), {others} more"),
    };
    ["", &what, "state", "since", "what it is", "why"].map(str::to_owned)
}

/// Merges kind and reason into one column.
fn merge(cells: &mut [String; 6]) {
    let what = std::mem::take(&mut cells[4]);
    let joint = if what.is_empty() || cells[5].is_empty() { "" } else { "; " };
    cells[5] = format!("{what}{joint}{}", cells[5]);
}

fn filter(model: &Model, area: Rect, cells: &mut Cells) {
    if !model.filter.trim().is_empty() || model.types_filter {
        let end = if model.types_filter { "_" } else { "" };
        let filter = format!(" filter: {}{end} ", printable(&model.filter));
        cells.right(area, 0, &filter, cells.palette.tone(Tone::Doubt));
    }
}

/// The reason why the list is empty; never a claim of health without evidence.
fn empty(model: &Model) -> String {
    let scene = model.shown();
    if !model.filter.trim().is_empty() {
        "no match; Esc clears the filter".to_owned()
    } else if scene.modules.is_empty() {
        "no module seen yet: start diagnosers, or use another endpoint with --connect".to_owned()
    } else {
        "no active alarms among reporting modules".to_owned()
    }
}

fn cells_of(row: &StateRow, now_unix_ns: u64) -> [String; 6] {
    let symbol = match row.component {
        Some(_) => symbol(row.urgency),
        None => module_symbol(row.tone),
    };
    [
        symbol.to_owned(),
        row.name(),
        row.state.clone(),
        row.since_unix_ns.map_or_else(String::new, |since| age(since, now_unix_ns)),
        row.what(),
        row.why.clone(),
    ]
}
