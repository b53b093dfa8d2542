//! One panel: two axes, series and marks.

use super::axis::PlotAxis;
use super::series::Series;

/// What a mark stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MarkKind {
    /// Something begins at this x: an unbroken vertical line.
    Onset,
    /// Something was found at this x: a dashed vertical line.
    Verdict,
    /// A limit on y: a dashed horizontal line, named in the legend.
    Level,
}

/// A line across a panel.
#[derive(Debug, Clone, PartialEq)]
pub struct PanelMark {
    /// Where: x, or y for a level.
    pub at: f64,
    /// What it says; may be empty.
    pub label: String,
    /// What it stands for.
    pub kind: MarkKind,
}

impl PanelMark {
    /// A mark.
    #[must_use]
    pub fn new(kind: MarkKind, at: f64, label: impl Into<String>) -> Self {
        Self { at, label: label.into(), kind }
    }
}

/// A panel of a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// What it shows.
    pub title: String,
    /// What is to be seen in it, in small letters; may be empty.
    pub note: String,
    /// The horizontal axis.
    pub x: PlotAxis,
    /// The vertical axis.
    pub y: PlotAxis,
    /// What is plotted, later series over earlier ones.
    pub series: Vec<Series>,
    /// Lines across.
    pub marks: Vec<PanelMark>,
}

impl Panel {
    /// A panel without marks.
    #[must_use]
    pub fn new(title: impl Into<String>, x: PlotAxis, y: PlotAxis, series: Vec<Series>) -> Self {
        Self { title: title.into(), note: String::new(), x, y, series, marks: Vec::new() }
    }

    /// The same with a note.
    #[must_use]
    pub fn note(self, note: impl Into<String>) -> Self {
        Self { note: note.into(), ..self }
    }

    /// The same with these marks besides those that it has.
    #[must_use]
    pub fn marked(mut self, marks: impl IntoIterator<Item = PanelMark>) -> Self {
        self.marks.extend(marks);
        self
    }
}
