//! The plot area of a panel: maps values to positions on the page.

use svg::node::element::Rectangle;

use super::ink;
use super::layout::PlotLayout;

/// The plot area of a panel at its vertical position.
pub(super) struct PlotArea<'a> {
    pub(super) layout: &'a PlotLayout<'a>,
    pub(super) top: f64,
    pub(super) height: f64,
}

impl PlotArea<'_> {
    /// The plot's edges.
    pub(super) fn outline(&self) -> Rectangle {
        let [left, width] = self.layout.across;
        Rectangle::new()
            .set("x", ink::tenths(left))
            .set("y", ink::tenths(self.top))
            .set("width", ink::tenths(width))
            .set("height", ink::tenths(self.height))
    }

    /// Its lower edge \[px\].
    pub(super) fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// The vertical position of a value; values beyond the range are placed on the edge.
    pub(super) fn down(&self, value: f64) -> f64 {
        let place = self.layout.y.place(value);
        self.bottom() - self.height * if place.is_nan() { place } else { place.clamp(0.0, 1.0) }
    }

    /// The position of a point, if x is within its range and y has a position.
    pub(super) fn point(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let point = [self.layout.across(x), self.down(y)];
        (self.layout.is_seen(x) && point[1].is_finite()).then_some(point)
    }
}
