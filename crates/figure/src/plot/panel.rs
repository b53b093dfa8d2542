//! One panel: two axes, series and marks.

use super::axis::PlotAxis;
use super::series::Series;

/// The meaning of a mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MarkKind {
    /// The beginning of an event at this x: a solid vertical line.
    Onset,
    /// A detection at this x: a dashed vertical line.
    Verdict,
    /// A limit on y: a dashed horizontal line, named in the legend.
    Level,
}

/// A line across a panel.
#[derive(Debug, Clone, PartialEq)]
pub struct PanelMark {
    /// The position: x, or y for a level.
    pub at: f64,
    /// The label; may be empty.
    pub label: String,
    /// Its meaning.
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
    /// The title.
    pub title: String,
    /// A note in small print; may be empty.
    pub note: String,
    /// The horizontal axis.
    pub x: PlotAxis,
    /// The vertical axis.
    pub y: PlotAxis,
    /// The series, later ones drawn over earlier ones.
    pub series: Vec<Series>,
    /// Lines across the panel.
    pub marks: Vec<PanelMark>,
}

impl Panel {
    /// A panel without marks.
    #[must_use]
    pub fn new(title: impl Into<String>, x: PlotAxis, y: PlotAxis, series: Vec<Series>) -> Self {
        Self { title: title.into(), note: String::new(), x, y, series, marks: Vec::new() }
    }

    /// The same panel with a note.
    #[must_use]
    pub fn note(self, note: impl Into<String>) -> Self {
        Self { note: note.into(), ..self }
    }

    /// The same panel with these marks added.
    #[must_use]
    pub fn marked(mut self, marks: impl IntoIterator<Item = PanelMark>) -> Self {
        self.marks.extend(marks);
        self
    }
}
