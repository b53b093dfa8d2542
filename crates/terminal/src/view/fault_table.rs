//! What needs attention, the most urgent first: state, since when, what it is, why.

use observer::{LiveModule, Urgency};
use ratatui::layout::Rect;
use ratatui::style::{Modifier, Style};
use wire::FaultTransition;
use wording::{Tone, aside, identified, printable, reason, state_in_words, state_tone};

use super::age::age;
use super::cells::{Cells, part, widths};
use super::palette::{module_symbol, symbol};
use crate::model::{Model, Pane, Row, Standing, Whose};

/// From this width on, what it is and why have a column each.
const WIDE: u16 = 110;

/// No column is wider than this; the last takes what is left.
const MOST: [u16; 6] = [1, 36, 20, 7, 44, 0];

/// A row before it is drawn.
struct Line {
    tone: Tone,
    cells: [String; 6],
}

pub(super) fn draw(model: &Model, area: Rect, cells: &mut Cells) {
    let (rows, is_active) = (model.rows(), model.pane == Pane::Faults);
    let lines: Vec<Line> = rows.iter().filter_map(|row| drawn(model, row)).collect();
    let mut texts = vec![heading(model, rows.len())];
    texts.extend(lines.iter().map(|line| line.cells.clone()));
    if area.width < WIDE {
        texts.iter_mut().for_each(merge);
    }
    let widths = widths(&texts, MOST);
    put(area, 0, &texts[0], (widths, cells.palette.heading(is_active)), cells);
    filter(model, area, cells);
    let body = part(area, 1, area.height);
    if rows.is_empty() {
        cells.text(body, 0, &empty(model), cells.palette.dim());
    }
    let (place, height) = (model.fault_place(&rows), usize::from(body.height));
    let first = (place + 1).saturating_sub(height);
    let shown = lines.iter().zip(&texts[1..]).enumerate().skip(first).take(height);
    for (line, (number, (row, texts))) in (0..).zip(shown) {
        let mut style = cells.palette.tone(row.tone);
        if is_active && number == place {
            style = style.add_modifier(Modifier::REVERSED);
        }
        put(body, line, texts, (widths, style), cells);
    }
}

/// What it is and why, of the row that is selected.
pub(super) fn selected(model: &Model) -> Option<String> {
    let rows = model.rows();
    let row = rows.get(model.fault_place(&rows)).filter(|_| model.pane == Pane::Faults)?;
    let mut cells = drawn(model, row)?.cells;
    merge(&mut cells);
    Some(format!("{}: {}", cells[1], cells[5])).filter(|_| !cells[5].is_empty())
}

fn heading(model: &Model, count: usize) -> [String; 6] {
    let what = match &model.scope {
        Some(scope) => format!("ALL OF {} ({count})", scope.module),
        None => format!("ALARMS ({count})"),
    };
    ["", &what, "state", "since", "what it is", "why"].map(str::to_owned)
}

/// What it is and why in one column.
fn merge(cells: &mut [String; 6]) {
    let what = std::mem::take(&mut cells[4]);
    let joint = if what.is_empty() || cells[5].is_empty() { "" } else { "; " };
    cells[5] = format!("{what}{joint}{}", cells[5]);
}

fn filter(model: &Model, area: Rect, cells: &mut Cells) {
    if !model.filter.is_empty() || model.types_filter {
        let end = if model.types_filter { "_" } else { "" };
        let filter = format!(" filter: {}{end} ", printable(&model.filter.0));
        cells.right(area, 0, &filter, cells.palette.tone(Tone::Doubt));
    }
}

fn put(
    area: Rect,
    line: u16,
    texts: &[String; 6],
    (widths, style): ([u16; 6], Style),
    cells: &mut Cells,
) {
    let columns = texts.iter().map(String::as_str).zip(widths).enumerate();
    // Without a column of its own, what it is stands with the reasons.
    let columns = columns.filter(|(place, (_, width))| *place != 4 || *width > 0);
    let columns: Vec<(&str, u16)> = columns.map(|(_, column)| column).collect();
    cells.row(area, line, &columns, style);
}

/// Why there is no row; nothing is called well that is not known.
fn empty(model: &Model) -> String {
    let scene = model.shown();
    if !model.filter.is_empty() {
        "nothing fits the filter; Esc ends it".to_owned()
    } else if scene.modules.is_empty() {
        "nothing is known yet: start diagnosers, or look elsewhere with --connect".to_owned()
    } else {
        "no alarm among the components that are heard of".to_owned()
    }
}

fn drawn(model: &Model, row: &Row) -> Option<Line> {
    let (scene, now_unix_ns) = (model.shown(), model.shown_unix_ns());
    match row {
        Row::Module(whose) => Some(of_module(whose.find(scene)?, whose, now_unix_ns)),
        Row::Component(subject) => Some(of_component(subject.find(scene)?, now_unix_ns)),
    }
}

fn of_module(module: &LiveModule, whose: &Whose, now_unix_ns: u64) -> Line {
    let standing = Standing::of(module);
    let member = &module.picture.member;
    let (since, why) = match standing {
        Standing::Silent(0) => ("ever".to_owned(), "it was never heard".to_owned()),
        Standing::Silent(since) => {
            (age(since, now_unix_ns), "its diagnoser is not heard".to_owned())
        }
        _ => {
            let change = member.phase_change.as_ref();
            let since =
                change.map_or_else(String::new, |change| age(change.time_unix_ns, now_unix_ns));
            (since, change.map(|change| printable(&change.reason)).unwrap_or_default())
        }
    };
    let unknown = module.picture.count(wire::FaultState::Unknown);
    let what = match (module.picture.components.len(), unknown) {
        (0, _) => "nothing is known of its components".to_owned(),
        (_, 1) => "1 component unknown".to_owned(),
        (_, unknown) => format!("{unknown} components unknown"),
    };
    let symbol = module_symbol(standing.tone()).to_owned();
    let (name, words) = (whose.module.to_string(), standing.words().to_owned());
    Line { tone: standing.tone(), cells: [symbol, name, words, since, what, why] }
}

fn of_component(component: &FaultTransition, now_unix_ns: u64) -> Line {
    let urgency = Urgency::of(component);
    let is_aside = urgency == Urgency::SetAside;
    let tone = if is_aside { Tone::Explained } else { state_tone(component.state()) };
    let why: Vec<String> =
        [aside(component), Some(reason(component))].into_iter().flatten().collect();
    let why: Vec<&str> = why.iter().map(String::as_str).filter(|text| !text.is_empty()).collect();
    Line {
        tone,
        cells: [
            symbol(urgency).to_owned(),
            component.component.to_string(),
            state_in_words(component),
            age(component.time_unix_ns, now_unix_ns),
            component.identification.as_deref().map(identified).unwrap_or_default(),
            why.join("; "),
        ],
    }
}
