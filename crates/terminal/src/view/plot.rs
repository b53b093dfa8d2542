//! Plots a curve over the steps with a level, a fitted curve and marks in braille dots. Level, fit and marks use
//! different characters, so that the plot is readable without colours.

use anstyle::AnsiColor;
use ratatui::buffer::{Buffer, Cell};
use ratatui::layout::Rect;
use ratatui::style::Color;
use ratatui::symbols::Marker;
use ratatui::widgets::Widget;
use ratatui::widgets::canvas::{Canvas, Context, Line, Points};
use vocabulary::words::decimals;

use super::cells::Cells;
use super::palette::Palette;

/// Width of the labels, in columns.
const LABELS: u16 = 8;
/// An empty cell of the canvas.
const BLANK: [&str; 2] = [" ", "⠀"];
/// The fitted curve, and where it coincides with measured dots.
const FITTED: [&str; 2] = ["•", "●"];

/// A curve over the steps.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plot {
    /// The quantity, with its unit.
    pub title: String,
    /// Pairs of step and value in the order of the steps, joined by lines unless a curve is fitted; values that are not
    /// finite are omitted.
    pub points: Vec<(f64, f64)>,
    /// A fitted curve, in the order of the steps.
    pub fitted: Vec<(f64, f64)>,
    /// A value of interest, drawn as a horizontal line.
    pub level: Option<f64>,
    /// Steps of interest, drawn as vertical lines.
    pub marks: Vec<f64>,
    /// The text shown instead if there are no points.
    pub otherwise: String,
}

impl Plot {
    /// The legend for a plot with a fitted curve.
    pub const FIT_LEGEND: &str = "⠒ measured   • fitted   ● both";

    /// The plot as lines of text; the first is the title, the last shows the steps.
    #[must_use]
    pub fn text(&self, width: u16, height: u16, colours: bool) -> String {
        let area = Rect::new(0, 0, width.max(1), height);
        let mut buffer = Buffer::empty(area);
        draw(self, area, &mut Cells { buffer: &mut buffer, palette: Palette { colours } });
        let lines = buffer.content().chunks(usize::from(area.width)).map(|line| {
            let runs = line.chunk_by(|one, next| one.fg == next.fg);
            let text: String = runs.map(run).collect();
            text.trim_end().to_owned() + "\n"
        });
        lines.collect()
    }
}

/// A run of cells of one colour, with the escape codes for it.
fn run(cells: &[Cell]) -> String {
    let text: String =
        cells.iter().map(Cell::symbol).collect::<String>().replace(BLANK[1], BLANK[0]);
    let colour = match cells[0].fg {
        Color::Green => AnsiColor::Green,
        Color::Cyan => AnsiColor::Cyan,
        _ => return text,
    };
    let style = colour.on_default();
    format!("{style}{text}{style:#}")
}

/// The range of a plot.
#[derive(Debug, Clone, Copy)]
struct AxisRange {
    low: f64,
    high: f64,
}

impl AxisRange {
    fn spanning(values: impl Iterator<Item = f64>) -> Option<Self> {
        let finite = values.filter(|value| value.is_finite());
        let range = finite.fold(None, |range: Option<AxisRange>, value| {
            let AxisRange { low, high } = range.unwrap_or(AxisRange { low: value, high: value });
            Some(AxisRange { low: low.min(value), high: high.max(value) })
        })?;
        // A constant curve gets some space above and below.
        let room = if range.high > range.low { 0.0 } else { (range.high.abs() * 0.1).max(1e-9) };
        Some(AxisRange { low: range.low - room, high: range.high + room })
    }

    /// The index of a value among so many positions, from the low end on.
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
    // Plots over the same steps stay aligned, even where values are undefined.
    let steps = AxisRange::spanning(plot.points.iter().map(|(step, _)| *step));
    let values = points.iter().chain(&plot.fitted).map(|(_, value)| *value);
    let values = AxisRange::spanning(values.chain(plot.level));
    let (Some(steps), Some(values), false) = (steps, values, points.is_empty()) else {
        cells.text(inner, 0, &plot.otherwise, cells.palette.dim());
        return;
    };
    if plot.fitted.is_empty() {
        curve(&points, (steps, values), inner, cells);
    } else {
        fit(&points, &plot.fitted, (steps, values), inner, cells);
    }
    level(plot, values, inner, cells);
    marks(plot, steps, inner, cells);
    labels((steps, values), area, inner, cells);
}

fn canvas<F: Fn(&mut Context<'_>)>(
    (steps, values): (AxisRange, AxisRange),
    paint: F,
) -> Canvas<'static, F> {
    Canvas::default()
        .x_bounds([steps.low, steps.high])
        .y_bounds([values.low, values.high])
        .paint(paint)
}

/// Draws lines between successive points.
fn join(context: &mut Context<'_>, points: &[(f64, f64)], color: Color) {
    for pair in points.windows(2) {
        let [(x1, y1), (x2, y2)] = [pair[0], pair[1]];
        context.draw(&Line { x1, y1, x2, y2, color });
    }
}

fn curve(points: &[(f64, f64)], ranges: (AxisRange, AxisRange), inner: Rect, cells: &mut Cells) {
    let color = cells.palette.colour(Color::Green);
    canvas(ranges, |context| join(context, points, color))
        .marker(Marker::Braille)
        .render(inner, cells.buffer);
}

/// Draws measured dots, and the fitted curve over them.
fn fit(
    points: &[(f64, f64)],
    fitted: &[(f64, f64)],
    ranges: (AxisRange, AxisRange),
    inner: Rect,
    cells: &mut Cells,
) {
    let color = cells.palette.colour(Color::Green);
    canvas(ranges, |context| context.draw(&Points { coords: points, color }))
        .marker(Marker::Braille)
        .render(inner, cells.buffer);
    let measured = cells.buffer.clone();
    let color = cells.palette.colour(Color::Cyan);
    canvas(ranges, |context| join(context, fitted, color))
        .marker(Marker::Dot)
        .render(inner, cells.buffer);
    for place in inner.positions() {
        if cells.buffer[place].symbol() == FITTED[0] && !BLANK.contains(&measured[place].symbol()) {
            cells.buffer[place].set_symbol(FITTED[1]);
        }
    }
}

fn level(plot: &Plot, values: AxisRange, inner: Rect, cells: &mut Cells) {
    let Some(place) = plot.level.and_then(|level| values.place(level, inner.height)) else {
        return;
    };
    let line = inner.y + inner.height - 1 - place;
    for column in inner.x..inner.x + inner.width {
        fill(column, line, "╌", cells);
    }
}

/// Draws the marks down to the axis of steps, where curves do not hide them.
fn marks(plot: &Plot, steps: AxisRange, inner: Rect, cells: &mut Cells) {
    for place in plot.marks.iter().filter_map(|mark| steps.place(*mark, inner.width)) {
        for line in inner.y..=inner.y + inner.height {
            fill(inner.x + place, line, "┊", cells);
        }
    }
}

/// Draws a symbol where the cell is empty.
fn fill(column: u16, line: u16, symbol: &str, cells: &mut Cells) {
    let cell = &mut cells.buffer[(column, line)];
    if BLANK.contains(&cell.symbol()) {
        cell.set_symbol(symbol);
    }
}

fn labels((steps, values): (AxisRange, AxisRange), area: Rect, inner: Rect, cells: &mut Cells) {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn jump() -> Plot {
        let value = |step: u32| if step < 1020 { 1.0 } else { 9.0 };
        Plot {
            title: "divergence".to_owned(),
            points: (1000..1040).map(|step| (f64::from(step), value(step))).collect(),
            level: Some(5.0),
            marks: vec![1020.0, 5000.0],
            ..Plot::default()
        }
    }

    /// A bias of which every second reading is a bit off.
    fn bias(count: u32) -> Plot {
        let fitted = |step| if step < count / 2 { 0.0 } else { 45.0 };
        let off = |step: u32| if step.is_multiple_of(2) { 4.0 } else { -4.0 };
        let at = |step| f64::from(36_000 + step);
        Plot {
            title: "µm".to_owned(),
            points: (0..count).map(|step| (at(step), fitted(step) + off(step))).collect(),
            fitted: (0..count).map(|step| (at(step), fitted(step))).collect(),
            ..Plot::default()
        }
    }

    #[test]
    fn a_curve_with_level_and_mark_is_this() {
        let expected = "divergence
     9.0┤            ⢸⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉
        │            ⢸
        │            ⢸
        │╌╌╌╌╌╌╌╌╌╌╌╌⢸╌╌╌╌╌╌╌╌╌╌╌╌
        │            ⡇
        │            ⡇
        │            ⡇
     1.0┤⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⡇
         step 1000   ┊        1039
";
        let text = jump().text(34, 10, false);
        assert_eq!(text, expected, "\n{text}");
    }

    #[test]
    fn a_fit_over_what_was_measured_is_this() {
        let expected = "µm
      49┤                 ⠁ ⠁ ⠁ ⠁ ⠁ ⠈ ⠈ ⠈
        │                 •●•●•●•●•●•●•●•●
        │                 •
        │                 •
        │                •
        │                •
        │                •
        │                •
        │               •
        │               •
        │●•●•●•●•●•●•●•●•
      -4┤ ⡀ ⡀ ⡀ ⢀ ⢀ ⢀ ⢀ ⢀
         step 36000                  36031
";
        let text = bias(32).text(42, 14, false);
        assert_eq!(text, expected, "\n{text}");
    }

    #[test]
    fn it_fits_any_width() {
        for width in [1, 12, 13, 20, 40, 80, 200] {
            for plot in [jump(), bias(120), bias(1), Plot::default()] {
                let text = plot.text(width, 10, false);
                let widest = text.lines().map(|line| line.chars().count()).max();
                assert!(widest <= Some(usize::from(width)), "{width}:\n{text}");
            }
        }
    }

    #[test]
    fn a_perfect_fit_covers_all_that_was_measured() {
        let points: Vec<_> = (0..60).map(|step| (f64::from(step), 1.0)).collect();
        let text = Plot { fitted: points.clone(), points, ..Plot::default() }.text(40, 14, false);
        assert!(text.contains("●●●●●●●●●●") && !text.contains('•'), "{text}");
        assert!(!text.chars().any(|c| ('⠁'..='⣿').contains(&c)), "{text}");
    }

    #[test]
    fn the_curves_of_a_fit_have_colours_where_there_are_any() {
        let text = bias(32).text(42, 14, true);
        assert!(text.contains("\x1b[32m") && text.contains("\x1b[36m"), "{text:?}");
        assert!(!bias(32).text(42, 14, false).contains('\x1b'));
    }
}
