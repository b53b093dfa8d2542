//! Computes the layout of a panel before it is drawn.

use super::axis::Fitted;
use super::ink;
use super::labels::{self, PlacedLabel, WantedLabel};
use super::panel::{MarkKind, Panel, PanelMark};

/// Height of the title's line \[px\].
pub(super) const TITLE: f64 = 17.0;
/// Height of the note's line \[px\].
const NOTE: f64 = 14.0;
/// Height of a lane of labels \[px\].
pub(super) const LANE: f64 = 14.0;
/// Space between the plot and the elements above it \[px\].
const ABOVE: f64 = 4.0;
/// Height of the ticks' labels below the plot \[px\].
pub(super) const TICK_LABELS: f64 = 17.0;
/// Height of the axis's label below that \[px\].
pub(super) const AXIS_LABEL: f64 = 16.0;
/// Length of a tick \[px\].
pub(super) const TICK: f64 = 4.0;

/// A panel with fitted axes, and the horizontal position of its plot.
pub(super) struct PlotLayout<'a> {
    pub(super) panel: &'a Panel,
    pub(super) x: Fitted,
    pub(super) y: Fitted,
    /// Left edge and width of the plot \[px\].
    pub(super) across: [f64; 2],
    /// Vertical marks with labels, and the positions of the labels.
    pub(super) labels: Vec<(&'a PanelMark, PlacedLabel)>,
}

impl<'a> PlotLayout<'a> {
    /// Lays out a panel whose plot begins at `left` and is `width` wide; labels may extend to `limits`.
    pub(super) fn new(panel: &'a Panel, [left, width]: [f64; 2], limits: [f64; 2]) -> Self {
        let seen = panel.x.range;
        let xs = panel.series.iter().flat_map(|series| series.points.iter().map(|point| point[0]));
        let heights = panel.series.iter().flat_map(|series| series.heights(seen));
        let levels = panel.marks.iter().filter(|mark| mark.kind == MarkKind::Level);
        let x = panel.x.fit(xs);
        let y = panel.y.fit(heights.chain(levels.map(|mark| mark.at)));
        let mut layout = Self { panel, x, y, across: [left, width], labels: Vec::new() };
        layout.labels = layout.place_labels(limits);
        layout
    }

    fn place_labels(&self, limits: [f64; 2]) -> Vec<(&'a PanelMark, PlacedLabel)> {
        let vertical = self.panel.marks.iter().filter(|mark| {
            mark.kind != MarkKind::Level && !mark.label.is_empty() && self.is_seen(mark.at)
        });
        let marks: Vec<&PanelMark> = vertical.collect();
        let wanted: Vec<WantedLabel> = (marks.iter())
            .map(|mark| WantedLabel {
                x: self.across(mark.at),
                width: ink::width(&mark.label, ink::SMALL),
                leftwards: mark.kind == MarkKind::Onset,
            })
            .collect();
        marks.into_iter().zip(labels::place(&wanted, limits)).collect()
    }

    /// Space needed above the plot \[px\].
    pub(super) fn above(&self) -> f64 {
        let note = if self.panel.note.is_empty() { 0.0 } else { NOTE };
        let lanes = self.labels.iter().map(|(_, placed)| placed.lane + 1).max().unwrap_or(0);
        TITLE + note + LANE * f64::from(lanes) + ABOVE
    }

    /// Space needed below the plot \[px\].
    pub(super) fn below(&self) -> f64 {
        let ticks = if self.panel.x.tick_labels { TICK_LABELS } else { TICK };
        ticks + if self.panel.x.label.is_empty() { 0.0 } else { AXIS_LABEL }
    }

    /// The horizontal position of a value of x \[px\].
    pub(super) fn across(&self, value: f64) -> f64 {
        self.across[0] + self.across[1] * self.x.place(value)
    }

    pub(super) fn is_seen(&self, x: f64) -> bool {
        (0.0..=1.0).contains(&self.x.place(x))
    }
}
