//! The signs of the drawing. They differ in shape and brightness as well as in colour: the colours are two of Okabe and
//! Ito's, one light and one dark.

use svg::node::element::{Circle, Group, Line, Polygon, Rectangle, Text};

use truss::{Direction, Support};

use super::projection::PagePoint;
use crate::plot::ink::{self, Anchor, PAPER, tenths};

/// Ink of lines and letters.
pub(super) const INK: &str = "#222222";
/// Secondary letters and lines.
pub(super) const FAINT: &str = "#666666";
const ACTUATOR: &str = "#e69f00";
const GAGE: &str = "#0072b2";

/// The style of a text.
#[derive(Clone, Copy)]
pub(super) struct Style {
    pub(super) size: f64,
    pub(super) weight: &'static str,
    pub(super) anchor: Anchor,
    pub(super) fill: &'static str,
}

impl Style {
    /// Running text.
    pub(super) const BODY: Style =
        Style { size: 15.0, weight: "normal", anchor: Anchor::Start, fill: INK };
    /// Headings.
    pub(super) const HEADING: Style =
        Style { size: 28.0, weight: "bold", anchor: Anchor::Start, fill: INK };
    /// Names of modules.
    pub(super) const NAME: Style =
        Style { size: 18.0, weight: "bold", anchor: Anchor::Start, fill: INK };
    /// Remarks.
    pub(super) const NOTE: Style =
        Style { size: 14.0, weight: "normal", anchor: Anchor::Start, fill: FAINT };
    /// Names beside symbols.
    pub(super) const LABEL: Style =
        Style { size: 14.0, weight: "bold", anchor: Anchor::Middle, fill: INK };
}

/// A text whose baseline starts at, or is centred at, this point.
pub(super) fn text(at: PagePoint, words: &str, style: Style) -> Text {
    ink::text([at.x, at.y], words, style.size, style.anchor)
        .set("font-family", ink::FONT)
        .set("font-weight", style.weight)
        .set("fill", style.fill)
}

/// A name centred at this point, legible on top of lines.
pub(super) fn label(at: PagePoint, words: &str, fill: &'static str) -> Text {
    let style = Style { fill, ..Style::LABEL };
    text(at.offset(0.0, 5.0), words, style)
        .set("stroke", PAPER)
        .set("stroke-width", 4)
        .set("stroke-linejoin", "round")
        .set("paint-order", "stroke")
}

/// Colour of an actuator's name.
pub(super) const ACTUATOR_INK: &str = "#8a4b00";
/// Colour of a gage's name.
pub(super) const GAGE_INK: &str = "#004b7a";

/// A straight line.
pub(super) fn line([from, to]: [PagePoint; 2], width: f64, colour: &str) -> Line {
    ink::line([from.x, from.y], [to.x, to.y], colour, width).set("stroke-linecap", "round")
}

/// A member: a line that hides everything behind it.
pub(super) fn member(line_between: [PagePoint; 2], width: f64, colour: &str) -> Group {
    let [from, to] = line_between;
    // The background-coloured rim ends short of the joints, so that it does not cut into neighbours.
    let rim = [from.towards(to, 0.04), to.towards(from, 0.04)];
    Group::new().add(line(rim, width + 3.0, PAPER).set("stroke-linecap", "butt")).add(line(
        line_between,
        width,
        colour,
    ))
}

/// A joint.
pub(super) fn joint(at: PagePoint, colour: &str) -> Circle {
    Circle::new()
        .set("cx", tenths(at.x))
        .set("cy", tenths(at.y))
        .set("r", 3.2)
        .set("fill", PAPER)
        .set("stroke", colour)
        .set("stroke-width", 1.6)
}

/// A hydraulic cylinder between two points: piston rods at both ends, the barrel in the middle.
pub(super) fn cylinder([from, to]: [PagePoint; 2]) -> Group {
    let angle = (to.y - from.y).atan2(to.x - from.x).to_degrees();
    let length = from.distance(to);
    let barrel = (0.45 * length).clamp(20.0, 96.0);
    let middle = from.towards(to, 0.5);
    Group::new()
        .add(line([from, to], 2.2, INK))
        .add(end_bar(from, [from, to]))
        .add(end_bar(to, [from, to]))
        .add(
            Rectangle::new()
                .set("x", tenths(-0.5 * barrel))
                .set("y", -5.5)
                .set("width", tenths(barrel))
                .set("height", 11)
                .set("rx", 2)
                .set("fill", ACTUATOR)
                .set("stroke", INK)
                .set("stroke-width", 1.6)
                .set("transform", placed(middle, angle)),
        )
}

/// A short bar across a line.
fn end_bar(at: PagePoint, [from, to]: [PagePoint; 2]) -> Line {
    let length = from.distance(to).max(1e-9);
    let across =
        PagePoint { x: -(to.y - from.y) / length * 6.0, y: (to.x - from.x) / length * 6.0 };
    line([at.offset(-across.x, -across.y), at.offset(across.x, across.y)], 2.2, INK)
}

/// A strain gage at a point of a line.
pub(super) fn gage(at: PagePoint, [from, to]: [PagePoint; 2]) -> Group {
    let angle = (to.y - from.y).atan2(to.x - from.x).to_degrees();
    let body = Rectangle::new()
        .set("x", -11)
        .set("y", -5.5)
        .set("width", 22)
        .set("height", 11)
        .set("rx", 5.5)
        .set("fill", GAGE)
        .set("stroke", PAPER)
        .set("stroke-width", 1.8);
    let grid = |y: f64| line([PagePoint { x: -6.0, y }, PagePoint { x: 6.0, y }], 1.3, PAPER);
    Group::new().set("transform", placed(at, angle)).add(body).add(grid(-1.8)).add(grid(1.8))
}

/// The sign of a support.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum SupportKind {
    Clamped,
    Pinned,
    Guided,
}

/// The sign for a support.
pub(super) fn kind_of_support(support: &Support) -> SupportKind {
    let translations = [Direction::X, Direction::Y, Direction::Z];
    if *support == Support::CLAMPED {
        SupportKind::Clamped
    } else if translations.into_iter().all(|direction| support.holds(direction)) {
        SupportKind::Pinned
    } else {
        SupportKind::Guided
    }
}

/// A support that fixes all translations, and possibly some rotations.
pub(super) fn pinned(at: PagePoint) -> Group {
    let corner = |x: f64, y: f64| format!("{},{}", tenths(at.x + x), tenths(at.y + y));
    let triangle = [corner(0.0, 2.0), corner(-10.0, 17.0), corner(10.0, 17.0)].join(" ");
    let triangle = Polygon::new()
        .set("points", triangle)
        .set("fill", PAPER)
        .set("stroke", INK)
        .set("stroke-width", 1.8)
        .set("stroke-linejoin", "round");
    hatched(Group::new().add(triangle), at.offset(0.0, 17.0), 14.0)
}

/// A support that fixes all translations and rotations.
pub(super) fn clamped(at: PagePoint) -> Group {
    let block = Rectangle::new()
        .set("x", tenths(at.x - 9.0))
        .set("y", tenths(at.y - 1.0))
        .set("width", 18)
        .set("height", 11)
        .set("fill", INK);
    hatched(Group::new().add(block), at.offset(0.0, 10.0), 14.0)
}

/// A support that fixes only some translations.
pub(super) fn guided(at: PagePoint) -> Group {
    let roller = Circle::new()
        .set("cx", tenths(at.x))
        .set("cy", tenths(at.y + 9.0))
        .set("r", 6.5)
        .set("fill", PAPER)
        .set("stroke", INK)
        .set("stroke-width", 1.8);
    hatched(Group::new().add(roller), at.offset(0.0, 16.0), 14.0)
}

/// Adds the ground: a line with strokes below.
fn hatched(group: Group, at: PagePoint, half: f64) -> Group {
    let mut group = group.add(line([at.offset(-half, 0.0), at.offset(half, 0.0)], 1.8, INK));
    for stroke in 0..5 {
        let x = -half + 3.0 + 6.0 * f64::from(stroke);
        group = group.add(line([at.offset(x, 0.5), at.offset(x - 4.0, 6.0)], 1.2, INK));
    }
    group
}

fn placed(at: PagePoint, degrees: f64) -> String {
    format!("translate({} {}) rotate({})", tenths(at.x), tenths(at.y), tenths(degrees))
}

/// A thin arrow.
pub(super) fn arrow([from, to]: [PagePoint; 2]) -> Group {
    let angle = (to.y - from.y).atan2(to.x - from.x).to_degrees();
    let head = Polygon::new()
        .set("points", "0,0 -9,-3.5 -9,3.5")
        .set("fill", FAINT)
        .set("transform", placed(to, angle));
    Group::new().add(line([from, from.towards(to, 0.85)], 1.6, FAINT)).add(head)
}

/// The plane between two modules.
pub(super) fn boundary(points: &str) -> Polygon {
    Polygon::new()
        .set("points", points)
        .set("fill", "#56b4e9")
        .set("fill-opacity", 0.18)
        .set("stroke", "#3a3a3a")
        .set("stroke-width", 1.3)
        .set("stroke-dasharray", "6 4")
}

/// Line width of a member [px].
pub(super) fn member_width(beam: bool) -> f64 {
    if beam { 5.0 } else { 2.2 }
}

/// Grey level of a member: darker if nearer.
pub(super) fn grey(nearness: f64) -> String {
    let level = (178.0 - 120.0 * nearness.clamp(0.0, 1.0)).round() as u8;
    format!("#{level:02x}{level:02x}{level:02x}")
}
