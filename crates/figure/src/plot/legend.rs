//! The legend beside a panel.

use svg::node::element::Group;

use super::ink::{self, Anchor};
use super::panel::{MarkKind, Panel, PanelMark};
use super::series::{Series, Shape};

/// Distance of two entries \[px\].
const LINE: f64 = 15.0;
/// Length of a line sample \[px\].
const SPECIMEN: f64 = 26.0;
/// Space around a sample \[px\].
const GAP: f64 = 7.0;

/// The entries of the legend. A single series needs none, because the title of the panel names it.
fn named(panel: &Panel) -> (Vec<&Series>, Vec<&PanelMark>) {
    let series = panel.series.iter().filter(|series| !series.name.is_empty()).collect();
    let is_level = |mark: &&PanelMark| mark.kind == MarkKind::Level && !mark.label.is_empty();
    (series, panel.marks.iter().filter(is_level).collect())
}

/// Space for the legend at the right of the panel \[px\].
pub(super) fn width(panel: &Panel) -> f64 {
    let (series, levels) = named(panel);
    let names = (series.iter().map(|series| series.name.as_str()))
        .chain(levels.iter().map(|level| level.label.as_str()));
    let widest = names.map(|name| ink::width(name, ink::SMALL)).fold(0.0, f64::max);
    if widest == 0.0 { 0.0 } else { 2.0 * GAP + SPECIMEN + widest }
}

/// Draws the legend with its upper left corner at this point.
pub(super) fn draw(panel: &Panel, [left, top]: [f64; 2]) -> Group {
    let (series, levels) = named(panel);
    let mut group = Group::new();
    let mut y = top + 0.5 * LINE;
    for level in levels {
        let ends = [[left + GAP, y], [left + GAP + SPECIMEN, y]];
        let line =
            ink::line(ends[0], ends[1], ink::INK, 1.0).set("stroke-dasharray", ink::LEVEL_DASH);
        group = group.add(line).add(name(left, y, &level.label));
        y += LINE;
    }
    for series in series {
        group = specimen(group, series, [left + GAP, y]).add(name(left, y, &series.name));
        y += LINE;
    }
    group
}

fn name(left: f64, y: f64, words: &str) -> svg::node::element::Text {
    let start = [left + 2.0 * GAP + SPECIMEN, y + 0.36 * ink::SMALL];
    ink::text(start, words, ink::SMALL, Anchor::Start)
}

fn specimen(group: Group, series: &Series, [x, y]: [f64; 2]) -> Group {
    let stroke = &series.stroke;
    let line = ink::line([x, y], [x + SPECIMEN, y], stroke.colour, stroke.width.max(1.5))
        .set("stroke-dasharray", if stroke.dash.is_empty() { "none" } else { stroke.dash });
    let dot = || ink::marker(stroke.marker, [x + 0.5 * SPECIMEN, y], stroke.colour);
    match series.shape {
        Shape::Line => group.add(line),
        Shape::MarkedLine => group.add(line).add(dot()),
        Shape::Dots => group.add(dot()),
    }
}
