//! The legend of the signs, the scale, and the directions of the axes.

use svg::node::element::{Group, Rectangle};
use truss::Structure;

use super::projection::{PagePoint, Projection};
use super::symbols::{self, Style, SupportKind, kind_of_support};
use crate::plot::ink::Anchor;

/// Width of the legend [px].
pub(super) const WIDTH: f64 = 282.0;
/// Height reserved for the legend [px].
pub(super) const HEIGHT: f64 = 370.0;
/// Distance between entries [px].
const ROW: f64 = 38.0;

/// The legend, limited to signs that occur in the drawing.
pub(super) fn legend(at: PagePoint, structure: &Structure) -> Group {
    let mut group = Group::new();
    let mut row = at.offset(18.0, 34.0);
    for (sign, words) in entries(structure) {
        group = group
            .add(sign.set("transform", format!("translate({} {})", row.x, row.y)))
            .add(symbols::text(row.offset(66.0, 5.0), words, Style::BODY));
        row = row.offset(0.0, ROW);
    }
    let frame = Rectangle::new()
        .set("x", at.x)
        .set("y", at.y)
        .set("width", WIDTH)
        .set("height", row.y - at.y - 4.0)
        .set("rx", 6)
        .set("fill", "#fafafa")
        .set("stroke", "#bbbbbb");
    Group::new().add(frame).add(group)
}

fn entries(structure: &Structure) -> Vec<(Group, &'static str)> {
    let across = [PagePoint { x: 0.0, y: 0.0 }, PagePoint { x: 48.0, y: 0.0 }];
    let middle = PagePoint { x: 24.0, y: 0.0 };
    let stroke = |beam: bool| {
        Group::new().add(symbols::line(across, symbols::member_width(beam), symbols::INK))
    };
    let supported = |kind: SupportKind| {
        structure
            .nodes
            .iter()
            .any(|node| node.support.is_any() && kind_of_support(&node.support) == kind)
    };
    let beams = structure.members.iter().any(|member| member.is_beam());
    let rods = structure.members.iter().any(|member| !member.is_beam());
    let actuators = structure.modules.iter().any(|module| !module.actuators.is_empty());
    let gages = structure.modules.iter().any(|module| !module.gages.is_empty());
    let boundaries = structure.modules.iter().any(|module| !module.lower_interface.is_empty());
    let all = [
        (beams, stroke(true), "beam"),
        (rods, stroke(false), "rod"),
        (true, Group::new().add(symbols::joint(middle, symbols::INK)), "node"),
        (actuators, Group::new().add(symbols::cylinder(across)), "actuator"),
        (gages, Group::new().add(stroke(false)).add(symbols::gage(middle, across)), "strain gage"),
        (
            supported(SupportKind::Pinned),
            Group::new().add(symbols::pinned(middle.offset(0.0, -10.0))),
            "support, free to tilt",
        ),
        (
            supported(SupportKind::Guided),
            Group::new().add(symbols::guided(middle.offset(0.0, -10.0))),
            "support, partly free to slide",
        ),
        (
            supported(SupportKind::Clamped),
            Group::new().add(symbols::clamped(middle.offset(0.0, -8.0))),
            "clamped support",
        ),
        (
            boundaries,
            Group::new().add(symbols::boundary("0,7 34,7 48,-7 14,-7")),
            "boundary of modules",
        ),
    ];
    all.into_iter().filter(|(occurs, ..)| *occurs).map(|(_, sign, words)| (sign, words)).collect()
}

/// A scale bar of a round number of metres, and the three axes.
pub(super) fn scale_and_axes(
    bar_at: PagePoint,
    axes_at: PagePoint,
    projection: &Projection,
) -> Group {
    let metres = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]
        .into_iter()
        .find(|metres| metres * projection.scale() >= 60.0)
        .unwrap_or(100.0);
    let end = bar_at.offset(metres * projection.scale(), 0.0);
    let mut group = Group::new()
        .add(symbols::line([bar_at, end], 2.0, symbols::INK))
        .add(symbols::text(end.offset(10.0, 5.0), &format!("{metres} m"), Style::NOTE));
    for tick in [bar_at, end] {
        let ends = [tick.offset(0.0, -5.0), tick.offset(0.0, 5.0)];
        group = group.add(symbols::line(ends, 2.0, symbols::INK));
    }
    group.add(axes(axes_at, projection))
}

fn axes(at: PagePoint, projection: &Projection) -> Group {
    let mut group = Group::new();
    for (name, axis) in [("x", [1.0, 0.0, 0.0]), ("y", [0.0, 1.0, 0.0]), ("z", [0.0, 0.0, 1.0])] {
        let metre = projection.direction(axis);
        let length = 44.0 / projection.scale();
        let tip = at.offset(metre.x * length, metre.y * length);
        let letter = at.towards(tip, 1.3).offset(0.0, 5.0);
        let style = Style { anchor: Anchor::Middle, ..Style::NOTE };
        group = group.add(symbols::arrow([at, tip])).add(symbols::text(letter, name, style));
    }
    group
}
