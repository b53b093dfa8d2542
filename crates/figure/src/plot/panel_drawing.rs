//! Draws a panel at the position computed by its layout.

use svg::node::element::Group;

use super::area::PlotArea;
use super::ink::{self, Anchor};
use super::layout::{PlotLayout, TITLE};
use super::legend;

/// Draws the panel: heading from `head` on, plot from `top` on with this height.
pub(super) fn draw(layout: &PlotLayout, name: &str, head: f64, top: f64, height: f64) -> Group {
    let plot = PlotArea { layout, top, height };
    let [left, width] = layout.across;
    let ground = plot.outline().set("fill", ink::PAPER);
    let frame = plot.outline().set("fill", "none").set("stroke", ink::FAINT);
    Group::new()
        .add(ground)
        .add(plot.axes())
        .add(plot.series())
        .add(plot.levels())
        .add(plot.marks())
        .add(frame)
        .add(plot.dots())
        .add(heading(layout, name, head))
        .add(legend::draw(layout.panel, [left + width, top]))
}

/// Title and note, left-aligned with the plot.
fn heading(layout: &PlotLayout, name: &str, head: f64) -> Group {
    let [left, _] = layout.across;
    let panel = layout.panel;
    let words = [name, &panel.title].join(if name.is_empty() { "" } else { " " });
    let title = ink::text([left, head + 12.0], &words, ink::BODY, Anchor::Start);
    let note = ink::text([left, head + TITLE + 9.0], &panel.note, ink::SMALL, Anchor::Start);
    let group = Group::new().add(title.set("font-weight", "bold"));
    if panel.note.is_empty() { group } else { group.add(note.set("fill", ink::FAINT)) }
}
