//! Series on a plot: bands, lines, markers.

use svg::node::element::{Group, Path, Polygon};

use super::ink;
use super::panel_drawing::PlotArea;
use super::series::{Series, Shape};

/// Half the width of the end of a whisker \[px\].
const WHISKER: f64 = 3.0;

impl PlotArea<'_> {
    /// Bands first, then lines.
    pub(super) fn series(&self) -> Group {
        let all = &self.layout.panel.series;
        let is_line = |series: &&Series| matches!(series.shape, Shape::Line | Shape::MarkedLine);
        let mut group = Group::new();
        for series in all.iter().filter(is_line).filter(|series| !series.spread.is_empty()) {
            group = group.add(self.band(series));
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
        runs.map(|run| extremes(&run.iter().copied().flatten().collect::<Vec<_>>())).collect()
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

/// The lowest and the highest point of each pixel column, in their order: this loses no peak, and more is not visible.
/// Points must have ascending x.
fn extremes(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let same_column = |a: &[f64; 2], b: &[f64; 2]| a[0].floor() == b[0].floor();
    let mut kept = Vec::with_capacity(points.len());
    for column in points.chunk_by(same_column) {
        let by_height = |a: &&[f64; 2], b: &&[f64; 2]| a[1].total_cmp(&b[1]);
        let Some(low) = column.iter().min_by(by_height) else { continue };
        let Some(high) = column.iter().max_by(by_height) else { continue };
        let (first, second) = if low[0] <= high[0] { (low, high) } else { (high, low) };
        kept.push(*first);
        if first != second {
            kept.push(*second);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_and_the_smallest_value_of_every_column_stay() {
        let height = |i: u32| f64::from(i.wrapping_mul(2_654_435_761) >> 20);
        let points: Vec<[f64; 2]> = (0..5000).map(|i| [f64::from(i) / 37.0, height(i)]).collect();
        let kept = extremes(&points);
        assert!(kept.len() <= 2 * 136, "{}", kept.len());
        for column in 0..136 {
            let of = |points: &[[f64; 2]]| {
                let inside = points.iter().filter(|p| p[0].floor() == f64::from(column));
                let ends = [f64::MAX, f64::MIN];
                inside.fold(ends, |[low, high], p| [low.min(p[1]), high.max(p[1])])
            };
            assert_eq!(of(&kept), of(&points), "{column}");
        }
        assert!(kept.is_sorted_by(|a, b| a[0] <= b[0]));
    }

    #[test]
    fn few_points_stay_as_they_are() {
        let points = [[0.5, 1.0], [1.5, 2.0], [4.0, 0.0]];
        assert_eq!(extremes(&points), points);
        assert!(extremes(&[]).is_empty());
    }
}
