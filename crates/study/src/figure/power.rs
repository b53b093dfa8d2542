//! Power curves: probability and delay of isolation against the size of a fault.

use figure::plot::{
    Figure, MarkKind, Panel, PanelMark, PanelRow, PlotAxis, Series, SeriesStyle, Shape, ticks,
};

use crate::limits::{LimitCurve, LimitPoint};
use crate::statistics::Interval95;

/// Most curves side by side.
const COLUMNS: usize = 3;
/// The probability of isolation that defines the minimum isolable fault.
const RELIABLE: f64 = 0.95;
/// The axis of probabilities \[%\], with space for markers at either end.
const PERCENT: [f64; 2] = [-4.0, 104.0];
/// Space above the largest delay, as a share of it.
const ROOM: f64 = 1.15;

/// Power curves as SVG: for each, isolation probability with its confidence band and, below, the
/// median delay, both against the fault's size on a logarithmic axis.
#[must_use]
pub fn power_figure(curves: &[LimitCurve]) -> String {
    // As few columns as possible without more rows than with the maximum number of columns.
    let rows = curves.len().div_ceil(COLUMNS).max(1);
    let columns = curves.len().div_ceil(rows).max(1);
    let rows = curves.chunks(columns).flat_map(|curves| {
        let probabilities = curves.iter().map(probability).collect();
        let delays = curves.iter().map(delay).collect();
        [PanelRow::new(150.0, probabilities), PanelRow::new(100.0, delays)]
            .map(|row| row.columns(columns))
    });
    let figure = Figure {
        title: "Minimum isolable fault".to_owned(),
        subtitle: "Share of runs in which the fault is isolated (band: confidence interval) and median delay; \
                   dashed: 95\u{a0}%"
            .to_owned(),
        description: curves.iter().map(sentence).collect::<Vec<_>>().join(" "),
        rows: rows.collect(),
    };
    figure.svg()
}

fn probability(curve: &LimitCurve) -> Panel {
    let share = |point: &LimitPoint| point.right.count as f64 / point.runs.max(1) as f64;
    let points = curve.points.iter().map(|point| [point.size, 100.0 * share(point)]);
    let spread = curve.points.iter().map(|LimitPoint { right, .. }| {
        let Interval95(low, high) = right.share_95;
        [100.0 * low, 100.0 * high]
    });
    let series = Series::new("", Shape::MarkedLine, stroke(), points.collect());
    let y = PlotAxis::linear("isolated [%]").over(PERCENT);
    let found = curve.smallest().map(|size| {
        let label = format!("{} {}", ticks::short(size), curve.unit);
        PanelMark::new(MarkKind::Verdict, size, label)
    });
    Panel::new(
        curve.kind.title(),
        size_axis(curve).bare(),
        y,
        vec![series.spread(spread.collect())],
    )
    .marked([PanelMark::new(MarkKind::Level, 100.0 * RELIABLE, "")])
    .marked(found)
}

fn delay(curve: &LimitCurve) -> Panel {
    let delay = |p: &LimitPoint| p.right.median_delay_ms.map(|delay| [p.size, delay]);
    let delays = curve.points.iter().filter_map(delay);
    let points: Vec<[f64; 2]> = delays.collect();
    let longest = points.iter().map(|point| point[1]).fold(1.0, f64::max);
    let series = Series::new("", Shape::MarkedLine, stroke(), points);
    let y = PlotAxis::linear("delay [ms]").over([0.0, ROOM * longest]);
    let found = curve.smallest().map(|size| PanelMark::new(MarkKind::Verdict, size, ""));
    Panel::new("Delay", size_axis(curve), y, vec![series]).marked(found)
}

fn stroke() -> SeriesStyle {
    SeriesStyle { width: 1.8, ..SeriesStyle::nth(0) }
}

/// The common axis of sizes of both panels of a curve.
fn size_axis(curve: &LimitCurve) -> PlotAxis {
    let sizes = curve.points.iter().map(|point| point.size).filter(|size| *size > 0.0);
    let ends = [f64::INFINITY, 0.0];
    let [low, high] = sizes.fold(ends, |[low, high], x| [low.min(x), f64::max(high, x)]);
    let axis = PlotAxis::log(format!("size [{}]", curve.unit));
    // Some space on either side.
    if low <= high { axis.over([low / 1.15, high * 1.15]) } else { axis.over([0.1, 10.0]) }
}

fn sentence(curve: &LimitCurve) -> String {
    match curve.smallest() {
        Some(size) => format!(
            "{}: isolated in 95 % of the runs from {} {} on.",
            curve.kind.title(),
            ticks::short(size),
            curve.unit
        ),
        None => format!("{}: no size tried is isolated in 95 % of the runs.", curve.kind.title()),
    }
}
