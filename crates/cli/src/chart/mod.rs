//! Two curves over the steps, drawn with characters: what was measured as dots (braille), what was fitted as a line. Where
//! both are the line is thick, so that the drawing can be read without colours.
//!
//! | file | job |
//! |---|---|
//! | `curve` | one curve with a level and marks |
//! | `scale` | from numbers to places |
//! | `canvas` | the cells and what is in them |

mod canvas;
mod curve;
mod scale;

pub(crate) use curve::{Curve, curve};

use canvas::{Canvas, Cell};
use scale::Scale;

use crate::paint::{Colour, Paint};
use wording::decimals;

/// Lines that the curves take.
const ROWS: usize = 12;
/// Blanks before everything, as in a table.
const INDENT: usize = 2;
/// No drawing is wider: dots would be few and far between.
const WIDEST: usize = 100;

/// A place that was measured, and what was fitted there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Point {
    pub(crate) step: u64,
    pub(crate) measured: f64,
    pub(crate) fitted: f64,
}

/// The drawing of points in the order of their steps, no wider than `width`; empty without any. `unit` is that of the
/// values.
pub(crate) fn chart(points: &[Point], unit: &str, width: usize, paint: Paint) -> String {
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return String::new() };
    let values = points.iter().flat_map(|point| [point.measured, point.fitted]);
    let heights = Scale::of(values);
    let labels = labels(&heights);
    let texts = labels.iter().map(String::as_str).chain([unit]);
    let margin = INDENT + texts.map(|text| text.chars().count()).max().unwrap_or_default();
    let columns = width.min(WIDEST).saturating_sub(margin + 2).max(1);
    let canvas = drawn(points, &heights, columns);
    let mut lines = vec![format!("{unit:>margin$}")];
    lines.extend(rows(&canvas, &labels, margin, paint));
    lines.push(format!("{:margin$} └{}", "", "─".repeat(columns)));
    lines.extend(steps(first.step, last.step, margin, columns));
    lines.push(format!("{:margin$}  {}", "", legend(paint)));
    lines.join("\n") + "\n"
}

fn drawn(points: &[Point], heights: &Scale, columns: usize) -> Canvas {
    #[expect(clippy::cast_precision_loss, reason = "a drawing")]
    let at = |point: &Point| point.step as f64;
    let steps = Scale::of(points.iter().map(at));
    let mut canvas = Canvas::new(columns, ROWS);
    for point in points {
        canvas.dot(steps.share(at(point)), heights.share(point.measured));
    }
    let line: Vec<[f64; 2]> =
        points.iter().map(|point| [steps.share(at(point)), heights.share(point.fitted)]).collect();
    canvas.line(&line);
    canvas
}

/// Of the highest, the middle and the lowest row.
fn labels(heights: &Scale) -> [String; 3] {
    let Scale { low, high } = *heights;
    let digits = decimals((high - low) / 20.0);
    [high, f64::midpoint(low, high), low].map(|value| format!("{value:.digits$}"))
}

/// The lines of a drawing, each with its axis before it; labels of the highest, the middle and the lowest.
fn rows(canvas: &Canvas, labels: &[String; 3], margin: usize, paint: Paint) -> Vec<String> {
    let all: Vec<_> = canvas.rows().collect();
    let (count, cells) = (all.len(), all.into_iter().enumerate());
    let line = |(row, cells): (usize, &[Cell])| {
        let label = match row {
            0 => &labels[0],
            row if row == count / 2 => &labels[1],
            row if row == count - 1 => &labels[2],
            _ => "",
        };
        let axis = if label.is_empty() { '│' } else { '┤' };
        let cells = cells.iter().map(|cell| match cell.is_line() {
            true => paint.in_colour(Colour::Cyan, &cell.character().to_string()),
            false => cell.character().to_string(),
        });
        let text = format!("{label:>margin$} {axis}{}", cells.collect::<String>());
        text.trim_end().to_owned()
    };
    cells.map(line).collect()
}

/// The first and the last step below the ends of the axis, if there is room for both.
fn steps(first: u64, last: u64, margin: usize, columns: usize) -> Option<String> {
    let (first, last) = (format!("step {first}"), last.to_string());
    let between = columns.checked_sub(first.len() + last.len())?;
    Some(format!("{:margin$}  {first}{:between$}{last}", "", ""))
}

fn legend(paint: Paint) -> String {
    let line = |character: &str| paint.in_colour(Colour::Cyan, character);
    format!("⠒ measured   {} fitted   {} both", line("─"), line("━"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bias of which every second reading is a bit off.
    fn bias(count: u64) -> Vec<Point> {
        let point = |step: u64| {
            let fitted = if step < count / 2 { 0.0 } else { 45.0 };
            let off = if step.is_multiple_of(2) { 4.0 } else { -4.0 };
            Point { step: 36_000 + step, measured: fitted + off, fitted }
        };
        (0..count).map(point).collect()
    }

    fn plain(points: &[Point], width: usize) -> String {
        chart(points, "µm", width, Paint::for_terminal(false))
    }

    #[test]
    fn the_drawing_is_this() {
        let expected = "  µm
  49 ┤                 ━─━─━─━─━─━─━─━─
     │                  ⡀ ⡀ ⡀ ⡀ ⢀ ⢀ ⢀ ⢀
     │
     │
     │
     │
  22 ┤                ─
     │
     │
     │
     │⠁ ⠁ ⠁ ⠁ ⠈ ⠈ ⠈ ⠈
  -4 ┤─━─━─━─━─━─━─━─━
     └─────────────────────────────────
      step 36000                  36031
      ⠒ measured   ─ fitted   ━ both
";
        let text = plain(&bias(32), 39);
        assert_eq!(text, expected, "\n{text}");
    }

    #[test]
    fn it_fits_any_width_and_shows_both_curves() {
        for width in [20, 40, 80, 200] {
            let text = plain(&bias(120), width);
            assert!(text.lines().skip(1).take(ROWS + 1).all(|line| line.chars().count() <= width));
            assert!(text.contains('─') && text.chars().any(|c| ('⠁'..='⣿').contains(&c)), "{text}");
        }
    }

    #[test]
    fn a_perfect_fit_is_a_thick_line() {
        let point = |step| Point { step, measured: 1.0, fitted: 1.0 };
        let points: Vec<Point> = (0..60).map(point).collect();
        let text = plain(&points, 40);
        let rows: Vec<&str> = text.lines().skip(1).take(ROWS).collect();
        let thick: Vec<&&str> = rows.iter().filter(|row| row.contains("━━━━━━━━━━")).collect();
        assert_eq!(thick.len(), 1, "{text}");
        assert!(!rows.iter().any(|row| row.contains('─')), "{text}");
    }

    #[test]
    fn a_single_point_is_drawn_and_none_is_nothing() {
        assert!(plain(&bias(1), 40).contains("step 36000"));
        assert_eq!(plain(&[], 40), "");
    }
}
