//! Lines and letters.

use std::fmt::Write;

use svg::node::element::{Circle, Line, Path, Polygon, Text};

use super::series::Marker;

/// Lines and letters.
pub(crate) const INK: &str = "#1a1a1a";
/// Secondary lines and letters.
pub(crate) const FAINT: &str = "#5a5a5a";
/// Lines in the background.
pub(crate) const GRID: &str = "#e4e4e4";
/// Background.
pub(crate) const PAPER: &str = "#ffffff";
/// Dashes of the line of a limit.
pub(crate) const LEVEL_DASH: &str = "6 3";
/// The typeface of all letters.
pub(crate) const FONT: &str = "Helvetica, Arial, 'DejaVu Sans', sans-serif";
/// Size of most letters \[px\].
pub(crate) const BODY: f64 = 11.5;
/// Size of small letters \[px\].
pub(crate) const SMALL: f64 = 10.5;
/// Width of an average letter over its size; a generous estimate, because the reader's font is not known.
const LETTER: f64 = 0.58;
/// Half the size of a marker \[px\].
const MARKER: f64 = 3.6;

/// The alignment of a text relative to its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

impl Anchor {
    fn as_str(self) -> &'static str {
        match self {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        }
    }
}

/// Estimated width of a text \[px\].
pub(crate) fn width(words: &str, size: f64) -> f64 {
    LETTER * size * words.chars().count() as f64
}

/// A text with its baseline at this point.
pub(crate) fn text(at: [f64; 2], words: &str, size: f64, anchor: Anchor) -> Text {
    Text::new(words)
        .set("x", tenths(at[0]))
        .set("y", tenths(at[1]))
        .set("font-size", size)
        .set("text-anchor", anchor.as_str())
}

/// A text that reads upwards, centred at this point.
pub(crate) fn upright(at: [f64; 2], words: &str, size: f64) -> Text {
    let turn = format!("rotate(-90 {} {})", tenths(at[0]), tenths(at[1]));
    text(at, words, size, Anchor::Middle).set("transform", turn)
}

/// A straight line.
pub(crate) fn line(from: [f64; 2], to: [f64; 2], colour: &str, width: f64) -> Line {
    Line::new()
        .set("x1", tenths(from[0]))
        .set("y1", tenths(from[1]))
        .set("x2", tenths(to[0]))
        .set("y2", tenths(to[1]))
        .set("stroke", colour)
        .set("stroke-width", width)
}

/// A line through points, with gaps between segments.
pub(crate) fn path(segments: &[Vec<[f64; 2]>]) -> Path {
    let mut data = String::new();
    for segment in segments {
        append(&mut data, segment);
    }
    Path::new().set("d", data).set("fill", "none").set("stroke-linejoin", "round")
}

/// Appends a segment in relative coordinates, which take about half the space of absolute ones. They are differences of
/// rounded points, so that rounding errors do not accumulate.
fn append(data: &mut String, segment: &[[f64; 2]]) {
    let mut last = [0, 0];
    for (index, point) in segment.iter().enumerate() {
        let here = point.map(|x| (x * 10.0).round() as i64);
        match index {
            0 => data.push('M'),
            1 => data.push('l'),
            _ => data.push(' '),
        }
        append_tenths(data, here[0] - last[0]);
        let down = here[1] - last[1];
        if down >= 0 {
            data.push(' ');
        }
        append_tenths(data, down);
        last = here;
    }
}

/// Appends a number of tenths as a decimal number.
fn append_tenths(data: &mut String, tenths: i64) {
    if tenths < 0 {
        data.push('-');
    }
    let (whole, rest) = (tenths.abs() / 10, tenths.abs() % 10);
    // Writing to a string cannot fail.
    let _ = match (whole, rest) {
        (_, 0) => write!(data, "{whole}"),
        (0, _) => write!(data, ".{rest}"),
        _ => write!(data, "{whole}.{rest}"),
    };
}

/// A closed area.
pub(crate) fn area(corners: &[[f64; 2]]) -> Polygon {
    let corners = corners.iter().map(|[x, y]| format!("{},{}", tenths(*x), tenths(*y)));
    Polygon::new().set("points", corners.collect::<Vec<_>>().join(" "))
}

/// A marker centred here.
pub(crate) fn marker(kind: Marker, [x, y]: [f64; 2], colour: &str) -> Box<dyn svg::node::Node> {
    let size = MARKER;
    let circle = || Circle::new().set("cx", tenths(x)).set("cy", tenths(y));
    let corners = |corners: &[[f64; 2]]| {
        let moved: Vec<_> = corners.iter().map(|[a, b]| [x + size * a, y + size * b]).collect();
        area(&moved).set("fill", colour).set("stroke", PAPER).set("stroke-width", 0.8)
    };
    match kind {
        Marker::Disc => Box::new(circle().set("r", size).set("fill", colour).set("stroke", PAPER)),
        Marker::Ring => Box::new(
            circle()
                .set("r", size)
                .set("fill", PAPER)
                .set("stroke", colour)
                .set("stroke-width", 1.5),
        ),
        Marker::Square => Box::new(corners(&[[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]])),
        Marker::Diamond => {
            Box::new(corners(&[[0.0, -1.45], [1.45, 0.0], [0.0, 1.45], [-1.45, 0.0]]))
        }
        Marker::Triangle => Box::new(corners(&[[0.0, -1.2], [1.15, 0.9], [-1.15, 0.9]])),
    }
}

/// A coordinate to a tenth of a pixel.
pub(crate) fn tenths(value: f64) -> f64 {
    (value * 10.0).round() / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_goes_from_point_to_point_in_tenths() {
        let mut data = String::new();
        append(&mut data, &[[10.0, 20.04], [10.54, 19.96], [9.0, 19.96]]);
        append(&mut data, &[[1.0, -2.0]]);
        assert_eq!(data, "M10 20l.5 0 -1.5 0M1-2");
    }
}
