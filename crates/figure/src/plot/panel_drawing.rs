//! Draws a panel at the position computed by its layout: axes, marks and heading.

use svg::node::element::{Group, Line, Rectangle};

use super::ink::{self, Anchor};
use super::layout::{AXIS_LABEL, LANE, PlotLayout, TICK, TICK_LABELS, TITLE};
use super::legend;
use super::panel::{MarkKind, PanelMark};

/// Distance of ticks that is easy to read, horizontally and vertically \[px\].
const TICK_DISTANCE: [f64; 2] = [75.0, 28.0];
/// Distance of the vertical axis's label from the plot \[px\].
const UPRIGHT: f64 = 48.0;

const VERDICT_DASH: &str = "4 2.5";

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

    /// Grid, ticks and labels of both axes.
    pub(super) fn axes(&self) -> Group {
        self.horizontal(self.vertical(Group::new()))
    }

    fn horizontal(&self, mut group: Group) -> Group {
        let PlotLayout { panel, x, across: [left, width], .. } = self.layout;
        let bottom = self.bottom();
        for tick in panel.x.ticks(x, width / TICK_DISTANCE[0]) {
            let at = self.layout.across(tick.value);
            let length = if tick.minor { 0.5 * TICK } else { TICK };
            group = group.add(ink::line([at, bottom], [at, bottom + length], ink::FAINT, 1.0));
            if !tick.minor {
                group = group.add(ink::line([at, self.top], [at, bottom], ink::GRID, 1.0));
            }
            let foot = [at, bottom + TICK_LABELS - 3.0];
            group = labelled(group, foot, &tick.label, ink::SMALL, Anchor::Middle);
        }
        let foot = [left + 0.5 * width, bottom + TICK_LABELS + AXIS_LABEL - 4.0];
        labelled(group, foot, &panel.x.label, ink::BODY, Anchor::Middle)
    }

    fn vertical(&self, mut group: Group) -> Group {
        let PlotLayout { panel, y, across: [left, width], .. } = self.layout;
        for tick in panel.y.ticks(y, self.height / TICK_DISTANCE[1]) {
            let at = self.down(tick.value);
            let length = if tick.minor { 0.5 * TICK } else { TICK };
            group = group.add(ink::line([left - length, at], [*left, at], ink::FAINT, 1.0));
            if !tick.minor {
                group = group.add(ink::line([*left, at], [left + width, at], ink::GRID, 1.0));
            }
            let side = [left - TICK - 3.0, at + 0.36 * ink::SMALL];
            group = labelled(group, side, &tick.label, ink::SMALL, Anchor::End);
        }
        let side = [left - UPRIGHT, self.top + 0.5 * self.height];
        group.add(ink::upright(side, &panel.y.label, ink::BODY))
    }

    /// Horizontal lines.
    pub(super) fn levels(&self) -> Group {
        let [left, width] = self.layout.across;
        let levels = self.layout.panel.marks.iter().filter(|mark| mark.kind == MarkKind::Level);
        levels.fold(Group::new(), |group, mark| {
            let y = self.down(mark.at);
            let line = ink::line([left, y], [left + width, y], ink::INK, 1.0);
            group.add(line.set("stroke-dasharray", ink::LEVEL_DASH))
        })
    }

    /// Vertical lines, extended up to their labels, and the labels.
    pub(super) fn marks(&self) -> Group {
        let is_vertical =
            |mark: &&PanelMark| mark.kind != MarkKind::Level && self.layout.is_seen(mark.at);
        let mut group = Group::new();
        for mark in self.layout.panel.marks.iter().filter(is_vertical) {
            group = group.add(self.upright(mark));
        }
        for (mark, placed) in &self.layout.labels {
            let baseline = self.top - LANE * f64::from(placed.lane) - 4.0;
            let start = [placed.start, baseline];
            group = group.add(ink::text(start, &mark.label, ink::SMALL, Anchor::Start));
        }
        group
    }

    fn upright(&self, mark: &PanelMark) -> Line {
        let x = self.layout.across(mark.at);
        let label = self.layout.labels.iter().find(|(labelled, _)| *labelled == mark);
        // The line passes beside its label, or ends below it if the label had to be placed above the line for lack of
        // space.
        let lanes = label.map_or(0, |(_, placed)| {
            let end = placed.start + ink::width(&mark.label, ink::SMALL);
            placed.lane + i32::from(x < placed.start || end < x)
        });
        let top = self.top - LANE * f64::from(lanes);
        let line = ink::line([x, top], [x, self.bottom()], ink::INK, 1.2);
        match mark.kind {
            MarkKind::Verdict => line.set("stroke-dasharray", VERDICT_DASH).set("class", "verdict"),
            MarkKind::Onset | MarkKind::Level => line.set("class", "onset"),
        }
    }
}

/// Adds this text to the group, unless it is empty.
fn labelled(group: Group, at: [f64; 2], words: &str, size: f64, anchor: Anchor) -> Group {
    if words.is_empty() { group } else { group.add(ink::text(at, words, size, anchor)) }
}
