//! Series on a plot: bands, bars, lines, markers.

use svg::node::element::{Group, Path, Polygon, Rectangle};

use super::area::PlotArea;
use super::decimation;
use super::ink;
use super::series::{Series, Shape};

/// Share of the distance between bars that a bar fills.
const BAR: f64 = 0.6;
/// Half the width of the end of a whisker \[px\].
const WHISKER: f64 = 3.0;

impl PlotArea<'_> {
    /// Bands first, then bars, then lines.
    pub(super) fn series(&self) -> Group {
        let all = &self.layout.panel.series;
        let is_line = |series: &&Series| matches!(series.shape, Shape::Line | Shape::MarkedLine);
        let mut group = Group::new();
        for series in all.iter().filter(is_line).filter(|series| !series.spread.is_empty()) {
            group = group.add(self.band(series));
        }
        for series in all.iter().filter(|series| series.shape == Shape::Bars) {
            group = self.bars(group, series);
        }
        for line in all.iter().filter(is_line).filter_map(|series| self.line(series)) {
            group = group.add(line);
        }
        group
    }

    /// The line of a series, if any of it is visible.
    fn line(&self, series: &Series) -> Option<Path> {
        let segments = self.segments(series);
        let line = ink::path(&segments)
            .set("stroke", series.stroke.colour)
            .set("stroke-width", series.stroke.width);
        let line = match series.stroke.dash {
            "" => line,
            dash => line.set("stroke-dasharray", dash),
        };
        (!segments.is_empty()).then_some(line)
    }

    /// The line of a series on the page, broken at points without a position.
    fn segments(&self, series: &Series) -> Vec<Vec<[f64; 2]>> {
        let points: Vec<Option<[f64; 2]>> =
            series.points.iter().map(|point| self.point(*point)).collect();
        let runs = points.split(|point| point.is_none()).filter(|run| !run.is_empty());
        runs.map(|run| decimation::extremes(&run.iter().copied().flatten().collect::<Vec<_>>()))
            .collect()
    }

    fn band(&self, series: &Series) -> Polygon {
        let ends = |which: usize| {
            let spread = series.points.iter().zip(&series.spread);
            spread.filter_map(move |([x, _], ends)| self.point([*x, ends[which]]))
        };
        let mut corners: Vec<[f64; 2]> = ends(0).collect();
        let back: Vec<[f64; 2]> = ends(1).collect();
        corners.extend(back.into_iter().rev());
        ink::area(&corners).set("fill", series.stroke.colour).set("fill-opacity", 0.18)
    }

    fn bars(&self, mut group: Group, series: &Series) -> Group {
        let width = BAR * (self.layout.across(1.0) - self.layout.across(0.0)).abs();
        let zero = self.down(0.0);
        for [x, y] in series.points.iter().filter_map(|point| self.point(*point)) {
            let bar = Rectangle::new()
                .set("x", ink::tenths(x - 0.5 * width))
                .set("y", ink::tenths(y.min(zero)))
                .set("width", ink::tenths(width))
                .set("height", ink::tenths((zero - y).abs()))
                .set("fill", series.stroke.colour);
            group = group.add(bar);
        }
        self.whiskers(group, series)
    }

    fn whiskers(&self, mut group: Group, series: &Series) -> Group {
        for ([x, _], ends) in series.points.iter().zip(&series.spread) {
            let [Some(low), Some(high)] = ends.map(|end| self.point([*x, end])) else { continue };
            group = group.add(ink::line(low, high, ink::INK, 1.2));
            for [x, y] in [low, high] {
                let end = ink::line([x - WHISKER, y], [x + WHISKER, y], ink::INK, 1.2);
                group = group.add(end);
            }
        }
        group
    }

    /// Markers, drawn over everything else.
    pub(super) fn dots(&self) -> Group {
        let mut group = Group::new();
        for series in &self.layout.panel.series {
            if series.shape == Shape::Dots {
                group = self.whiskers(group, series);
            }
            if matches!(series.shape, Shape::Dots | Shape::MarkedLine) {
                for point in series.points.iter().filter_map(|point| self.point(*point)) {
                    let stroke = &series.stroke;
                    group = group.add(ink::marker(stroke.marker, point, stroke.colour));
                }
            }
        }
        group
    }
}
