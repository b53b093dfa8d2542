//! Data series and their style.

/// The palette of Okabe and Ito, with a grey in place of the yellow, which is hard to see on white paper.
const COLOURS: [&str; 8] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#000000", "#e69f00", "#56b4e9", "#7f7f7f"];
/// Dash patterns, so that lines also differ in greyscale print.
const DASHES: [&str; 8] = ["", "7 2", "3 1.5", "8 2 2 2", "14 2", "5 2 1 2 1 2", "1.5 1.5", "4 4"];
const DOTTED: &str = "1 2";
const THIN: f64 = 1.1;
const THICK: f64 = 2.2;

/// A symbol at a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marker {
    /// A filled circle.
    Disc,
    /// An open circle.
    Ring,
    /// A filled square.
    Square,
    /// A filled square on its corner.
    Diamond,
    /// A filled triangle.
    Triangle,
}

/// The shape of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// A line from point to point, broken at values that are NaN or have no position.
    Line,
    /// A line with a marker at each point.
    MarkedLine,
    /// A marker at each point.
    Dots,
}

/// Colour, line and marker of a series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeriesStyle {
    /// Colour in SVG notation.
    pub colour: &'static str,
    /// Dash pattern in SVG notation; empty for a solid line.
    pub dash: &'static str,
    /// Width of the line \[px\].
    pub width: f64,
    /// The marker.
    pub marker: Marker,
}

impl SeriesStyle {
    /// The style of the n-th of several series, from 0; repeats after the eighth.
    #[must_use]
    pub fn nth(n: usize) -> Self {
        let markers =
            [Marker::Disc, Marker::Square, Marker::Triangle, Marker::Diamond, Marker::Ring];
        Self {
            colour: COLOURS[n % COLOURS.len()],
            dash: DASHES[n % DASHES.len()],
            width: THIN,
            marker: markers[n % markers.len()],
        }
    }

    /// The same style with a solid line.
    #[must_use]
    pub fn solid(self) -> Self {
        Self { dash: "", ..self }
    }

    /// The same style with a dotted line.
    #[must_use]
    pub fn dotted(self) -> Self {
        Self { dash: DOTTED, width: 1.4, ..self }
    }

    /// The same style, emphasised.
    #[must_use]
    pub fn emphasised(self) -> Self {
        Self { width: THICK, ..self }
    }
}

/// A series of data points.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend; empty to omit it.
    pub name: String,
    /// x and y of each point, in the order in which a line connects them.
    pub points: Vec<[f64; 2]>,
    /// Lowest and highest y of each point, drawn as a band around a line and as whiskers for dots; empty for none.
    pub spread: Vec<[f64; 2]>,
    /// Its shape.
    pub shape: Shape,
    /// Its style.
    pub stroke: SeriesStyle,
}

impl Series {
    /// A series without a spread.
    #[must_use]
    pub fn new(
        name: impl Into<String>,
        shape: Shape,
        stroke: SeriesStyle,
        points: Vec<[f64; 2]>,
    ) -> Self {
        Self { name: name.into(), points, spread: Vec::new(), shape, stroke }
    }

    /// The same with a spread around each point.
    #[must_use]
    pub fn spread(self, spread: Vec<[f64; 2]>) -> Self {
        Self { spread, ..self }
    }

    /// All values of y that must be visible while x is within the range.
    pub(super) fn heights(&self, range: Option<[f64; 2]>) -> impl Iterator<Item = f64> {
        let seen = move |x: f64| range.is_none_or(|[from, to]| from <= x && x <= to);
        let spread = self.points.iter().zip(&self.spread);
        let points = self.points.iter().filter(move |[x, _]| seen(*x)).map(|[_, y]| *y);
        let spread = spread.filter(move |([x, _], _)| seen(*x)).flat_map(|(_, ends)| *ends);
        points.chain(spread)
    }
}
