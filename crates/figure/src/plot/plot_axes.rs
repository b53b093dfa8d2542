//! Axes of a plot: grid, ticks, labels.

use svg::node::element::Group;

use super::area::PlotArea;
use super::ink::{self, Anchor};
use super::layout::{AXIS_LABEL, PlotLayout, TICK, TICK_LABELS};

/// Distance of ticks that is easy to read, horizontally and vertically \[px\].
const TICK_DISTANCE: [f64; 2] = [75.0, 28.0];
/// Distance of the vertical axis's label from the plot \[px\].
const UPRIGHT: f64 = 48.0;

impl PlotArea<'_> {
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
}

/// Adds this text to the group, unless it is empty.
fn labelled(group: Group, at: [f64; 2], words: &str, size: f64, anchor: Anchor) -> Group {
    if words.is_empty() { group } else { group.add(ink::text(at, words, size, anchor)) }
}
