//! One curve over the steps, drawn with dots, with a level across as a line and marks below.

use super::canvas::Canvas;
use super::scale::Scale;
use super::{INDENT, WIDEST, labels, rows, steps};
use crate::paint::{Colour, Paint};

/// Lines that the curve takes.
const ROWS: usize = 8;

/// What is drawn.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Curve {
    /// What is above the axis: what it is, in which unit.
    pub(crate) title: String,
    /// Steps, in order, and values.
    pub(crate) points: Vec<(u64, f64)>,
    /// A value that is of interest, and what it is called.
    pub(crate) level: Option<(f64, &'static str)>,
    /// Steps that are of interest.
    pub(crate) marks: Vec<u64>,
}

/// The drawing, no wider than `width`; empty without any point.
pub(crate) fn curve(curve: &Curve, width: usize, paint: Paint) -> String {
    let points = &curve.points;
    let (Some((first, _)), Some((last, _))) = (points.first(), points.last()) else {
        return String::new();
    };
    let level = curve.level.map(|(level, _)| level);
    let heights = Scale::of(points.iter().map(|(_, value)| *value).chain(level));
    let labels = labels(&heights);
    let longest = labels.iter().map(|label| label.chars().count()).max().unwrap_or_default();
    let margin = INDENT + longest;
    let columns = width.min(WIDEST).saturating_sub(margin + 2).max(1);
    let along = Along { steps: Scale::of([*first, *last].map(at).into_iter()), columns };
    let mut lines = vec![title(curve, width, paint)];
    let canvas = drawn(curve, &along, &heights);
    lines.extend(rows(&canvas, &labels, margin, paint));
    lines.push(format!("{:margin$} └{}", "", along.axis(&curve.marks)));
    lines.extend(steps(*first, *last, margin, columns));
    lines.join("\n") + "\n"
}

/// The title and what the line is, as far as there is room.
fn title(curve: &Curve, width: usize, paint: Paint) -> String {
    let title = format!("{:INDENT$}{}", "", curve.title);
    let Some((_, name)) = curve.level else { return title };
    if title.chars().count() + name.chars().count() + 5 > width {
        return title;
    }
    format!("{title}   {} {name}", paint.in_colour(Colour::Cyan, "─"))
}

#[expect(clippy::cast_precision_loss, reason = "a drawing")]
fn at(step: u64) -> f64 {
    step as f64
}

fn drawn(curve: &Curve, along: &Along, heights: &Scale) -> Canvas {
    let mut canvas = Canvas::new(along.columns, ROWS);
    for (step, value) in curve.points.iter().filter(|(_, value)| value.is_finite()) {
        canvas.dot(along.steps.share(at(*step)), heights.share(*value));
    }
    if let Some((level, _)) = curve.level {
        let height = heights.share(level);
        canvas.line(&[[0.0, height], [1.0, height]]);
    }
    canvas
}

/// The horizontal axis.
struct Along {
    steps: Scale,
    columns: usize,
}

impl Along {
    /// The line of the axis with the marks that are on it.
    fn axis(&self, marks: &[u64]) -> String {
        let mut axis = vec!['─'; self.columns];
        let on_it = |mark: &&u64| (self.steps.low..=self.steps.high).contains(&at(**mark));
        for mark in marks.iter().filter(on_it) {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_precision_loss,
                clippy::cast_sign_loss,
                reason = "a column of a terminal"
            )]
            let column = (self.steps.share(at(*mark)) * self.columns as f64) as usize;
            axis[column.min(self.columns - 1)] = '┴';
        }
        axis.into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn jump() -> Curve {
        let value = |step| if step < 1020 { 1.0 } else { 9.0 };
        Curve {
            title: "divergence".to_owned(),
            points: (1000..1040).map(|step| (step, value(step))).collect(),
            level: Some((5.0, "threshold")),
            marks: vec![1020, 1039, 5000],
        }
    }

    #[test]
    fn the_drawing_is_this() {
        let expected = "  divergence   ─ threshold
  9.0 ┤            ⠈⠁⠉⠁⠉⠉⠈⠉⠈⠉⠁⠉⠉
      │
      │
      │
  5.0 ┤─────────────────────────
      │
      │
  1.0 ┤⣀⣀⢀⣀⡀⣀⡀⣀⣀⢀⣀⢀⡀
      └────────────┴───────────┴
       step 1000            1039
";
        let text = curve(&jump(), 32, Paint::for_terminal(false));
        assert_eq!(text, expected, "\n{text}");
    }

    #[test]
    fn it_fits_any_width_and_without_points_there_is_nothing() {
        for width in [20, 40, 80, 200] {
            let text = curve(&jump(), width, Paint::for_terminal(false));
            assert!(text.lines().all(|line| line.chars().count() <= width), "{text}");
        }
        let empty = Curve { points: Vec::new(), ..jump() };
        assert_eq!(curve(&empty, 40, Paint::for_terminal(false)), "");
        let unknown = Curve { points: vec![(3, f64::NAN)], level: None, ..jump() };
        assert!(curve(&unknown, 40, Paint::for_terminal(false)).contains("step 3"));
    }
}
