//! Marks on a plot: lines across it, and their labels.

use svg::node::element::{Group, Line};

use super::area::PlotArea;
use super::ink::{self, Anchor};
use super::layout::LANE;
use super::panel::{MarkKind, PanelMark};

const VERDICT_DASH: &str = "4 2.5";

impl PlotArea<'_> {
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
