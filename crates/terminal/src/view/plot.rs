//! One curve over the steps with a level and marks, drawn with dots (braille). Level and marks are lines of other
//! characters, so that the drawing can be read without colours.

use ratatui::layout::Rect;
use ratatui::style::Color;
use ratatui::symbols::Marker;
use ratatui::widgets::Widget;
use ratatui::widgets::canvas::{Canvas, Line};
use wording::decimals;

use super::cells::Cells;

/// Columns of the labels.
const LABELS: u16 = 8;
/// An empty cell of the canvas.
const BLANK: [&str; 2] = [" ", "⠀"];

/// What is drawn.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Plot {
    pub(super) title: String,
    /// Step and value, in the order of the steps; a value that is not finite is left out.
    pub(super) points: Vec<(f64, f64)>,
    pub(super) level: Option<f64>,
    pub(super) marks: Vec<f64>,
    /// What stands instead of the curve if there are no points.
    pub(super) otherwise: String,
}

/// The range of a plot.
#[derive(Debug, Clone, Copy)]
struct Range {
    low: f64,
    high: f64,
}

impl Range {
    fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let finite = values.filter(|value| value.is_finite());
        let range = finite.fold(None, |range: Option<Range>, value| {
            let Range { low, high } = range.unwrap_or(Range { low: value, high: value });
            Some(Range { low: low.min(value), high: high.max(value) })
        })?;
        // Of a constant, some room around it.
        let room = if range.high > range.low { 0.0 } else { (range.high.abs() * 0.1).max(1e-9) };
        Some(Range { low: range.low - room, high: range.high + room })
    }

    /// Which of so many places, from the low end on.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "within the places"
    )]
    fn place(self, value: f64, places: u16) -> Option<u16> {
        let share = (value - self.low) / (self.high - self.low);
        let is_within = (0.0..=1.0).contains(&share) && places > 0;
        is_within.then(|| (share * f64::from(places - 1)).round() as u16)
    }
}

pub(super) fn draw(plot: &Plot, area: Rect, cells: &mut Cells) {
    cells.text(area, 0, &plot.title, cells.palette.plain());
    if area.height < 3 || area.width <= LABELS + 4 {
        return;
    }
    let inner = Rect {
        x: area.x + LABELS + 1,
        y: area.y + 1,
        width: area.width - LABELS - 1,
        height: area.height - 2,
    };
    let points: Vec<_> =
        plot.points.iter().copied().filter(|(_, value)| value.is_finite()).collect();
    let steps = Range::of(points.iter().map(|(step, _)| *step));
    let values = Range::of(points.iter().map(|(_, value)| *value).chain(plot.level));
    let (Some(steps), Some(values), false) = (steps, values, points.is_empty()) else {
        cells.text(inner, 0, &plot.otherwise, cells.palette.dim());
        return;
    };
    curve(&points, (steps, values), inner, cells);
    level(plot, values, inner, cells);
    marks(plot, steps, inner, cells);
    labels((steps, values), area, inner, cells);
}

fn curve(points: &[(f64, f64)], (steps, values): (Range, Range), inner: Rect, cells: &mut Cells) {
    let color = if cells.palette.colours { Color::Green } else { Color::Reset };
    Canvas::default()
        .marker(Marker::Braille)
        .x_bounds([steps.low, steps.high])
        .y_bounds([values.low, values.high])
        .paint(|context| {
            for pair in points.windows(2) {
                let [(x1, y1), (x2, y2)] = [pair[0], pair[1]];
                context.draw(&Line { x1, y1, x2, y2, color });
            }
        })
        .render(inner, cells.buffer);
}

fn level(plot: &Plot, values: Range, inner: Rect, cells: &mut Cells) {
    let Some(place) = plot.level.and_then(|level| values.place(level, inner.height)) else {
        return;
    };
    let line = inner.y + inner.height - 1 - place;
    for column in inner.x..inner.x + inner.width {
        fill(column, line, "╌", cells);
    }
}

fn marks(plot: &Plot, steps: Range, inner: Rect, cells: &mut Cells) {
    for place in plot.marks.iter().filter_map(|mark| steps.place(*mark, inner.width)) {
        for line in inner.y..inner.y + inner.height {
            fill(inner.x + place, line, "┊", cells);
        }
    }
}

/// Where the curve is not.
fn fill(column: u16, line: u16, symbol: &str, cells: &mut Cells) {
    let cell = &mut cells.buffer[(column, line)];
    if BLANK.contains(&cell.symbol()) {
        cell.set_symbol(symbol);
    }
}

fn labels((steps, values): (Range, Range), area: Rect, inner: Rect, cells: &mut Cells) {
    let digits = decimals((values.high - values.low) / 20.0);
    for (line, value) in [(inner.y, values.high), (inner.y + inner.height - 1, values.low)] {
        let label = format!("{value:.digits$}");
        let place = Rect { y: line, width: LABELS, height: 1, ..area };
        cells.right(place, 0, &label, cells.palette.plain());
        fill(inner.x - 1, line, "┤", cells);
    }
    for line in inner.y + 1..inner.y + inner.height - 1 {
        fill(inner.x - 1, line, "│", cells);
    }
    let below = Rect { y: inner.y + inner.height, height: 1, ..inner };
    cells.text(below, 0, &format!("step {:.0}", steps.low), cells.palette.dim());
    cells.right(below, 0, &format!("{:.0}", steps.high), cells.palette.dim());
}
