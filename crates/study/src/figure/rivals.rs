//! The share of faults whose component a detector names, against the size of the fault.

use figure::plot::{Figure, Panel, PanelRow, PlotAxis, Series, SeriesStyle, Shape};

use crate::report::percent;
use crate::rivals::{RivalRow, RivalSummary, SizedFaults};
use crate::statistics::Interval95;

/// The first detector and so many others are drawn, the best ones.
const OTHERS: usize = 4;
/// The axis of shares \[%\], with space for markers at either end.
const PERCENT: [f64; 2] = [-4.0, 104.0];

/// A panel for each kind of fault with a size: the shipped divergence with its confidence band, and the best others at the
/// same rate of false alarms.
#[must_use]
pub fn rivals_figure(summary: &RivalSummary) -> String {
    let mut rows: Vec<&RivalRow> = summary.rows.iter().filter(|row| row.at_common_rate).collect();
    if let Some((_, others)) = rows.split_first_mut() {
        others.sort_by(|a, b| b.right.total_cmp(&a.right));
    }
    rows.truncate(1 + OTHERS);
    let panel = |sized: SizedFaults| {
        let series = |(place, row): (usize, &&RivalRow)| {
            let points = row.curves.get(&sized).map(Vec::as_slice).unwrap_or_default();
            let shares = points.iter().map(|point| [point.size, 100.0 * point.right]);
            let style = SeriesStyle {
                width: if place == 0 { 2.4 } else { 1.2 },
                ..SeriesStyle::nth(place)
            };
            let series = Series::new(row.detector, Shape::MarkedLine, style, shares.collect());
            let spread = points.iter().map(|point| {
                let Interval95(low, high) = point.right_95;
                [100.0 * low, 100.0 * high]
            });
            if place == 0 { series.spread(spread.collect()) } else { series }
        };
        let series = rows.iter().enumerate().map(series).collect();
        let y = PlotAxis::linear("right component [%]").over(PERCENT);
        let (title, unit) = sized.words();
        Panel::new(title, PlotAxis::log(format!("size [{unit}]")), y, series)
    };
    let sentence = |row: &&RivalRow| format!("{}: {}.", row.detector, percent(row.right));
    let figure = Figure {
        title: "Right component at the same rate of false alarms".to_owned(),
        subtitle: format!(
            "Limits for {} false alarms per hour; band: confidence interval of the shipped divergence",
            summary.per_hour
        ),
        description: rows.iter().map(sentence).collect::<Vec<_>>().join(" "),
        rows: SizedFaults::ALL.map(|sized| PanelRow::new(150.0, vec![panel(sized)])).into(),
    };
    figure.svg()
}
